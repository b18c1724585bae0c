"""Every effect that can be named; `bias` is always declared and has no unit of its own."""

from __future__ import annotations

from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.effects.bias_drift import BiasDrift
from gsense_fusion.identification.effects.clipping import AccelClipping, GyroClipping
from gsense_fusion.identification.effects.clock_skew import ClockSkew
from gsense_fusion.identification.effects.encoder_scale import EncoderScale
from gsense_fusion.identification.effects.line_tone import LineTone
from gsense_fusion.identification.effects.magnetic import MagMotor, MagPosition
from gsense_fusion.identification.effects.quantization import Quantization
from gsense_fusion.identification.effects.recorded import RecordedEffect
from gsense_fusion.identification.effects.sample_loss import SampleLoss
from gsense_fusion.identification.effects.speed_noise import SpeedNoise

RECORDED: tuple[RecordedEffect, ...] = (
    SampleLoss(),
    ClockSkew(),
    EncoderScale(),
    GyroClipping(),
    AccelClipping(),
    Quantization(),
    MagPosition(),
    MagMotor(),
)
"""Effects that the recording itself shows; looked for even where the catalogue that is used does not name them."""
CATALOGUE: tuple[Effect, ...] = (*REGRESSED, BiasDrift(), SpeedNoise(), LineTone(), *RECORDED)
