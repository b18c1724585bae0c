"""Every effect that can be named; `bias` is always declared and has no unit of its own."""

from __future__ import annotations

from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.effects.line_tone import LineTone
from gsense_fusion.identification.effects.speed_noise import SpeedNoise

CATALOGUE: tuple[Effect, ...] = (*REGRESSED, SpeedNoise(), LineTone())
