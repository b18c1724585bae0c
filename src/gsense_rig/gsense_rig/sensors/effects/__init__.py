"""Effects that the simulation can add to a unit; `parse_effects` reads them from NAME=VALUE.

To add one: write its class beside its owner's others (sensor, chain, rail) and name it in `EFFECTS` below.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from gsense_rig.sensors.effects.base import Effect
from gsense_rig.sensors.effects.chain import (
    ClockSkew,
    FrictionPickup,
    LineTone,
    MagMotor,
    SampleLoss,
    SpeedPickup,
    SupplyVoltage,
    TimeOffset,
)
from gsense_rig.sensors.effects.rail import (
    BeltTilt,
    BeltTooth,
    EncoderScale,
    MagPosition,
    RailCurvature,
    ReversalRock,
    SpeedNoise,
    ViscousTilt,
)
from gsense_rig.sensors.effects.sensor import (
    AccelClipping,
    Bias,
    BiasDrift,
    BiasJump,
    GCubed,
    GResonance,
    GSensitivity,
    GSquared,
    GyroClipping,
    JerkCoupling,
    Quantization,
    TemperatureBias,
)

EFFECTS: dict[str, type[Effect]] = {
    effect.name: effect
    for effect in (
        Bias,
        GSensitivity,
        TemperatureBias,
        BiasDrift,
        BiasJump,
        GSquared,
        GCubed,
        GResonance,
        JerkCoupling,
        AccelClipping,
        GyroClipping,
        Quantization,
        TimeOffset,
        SampleLoss,
        ClockSkew,
        SupplyVoltage,
        SpeedPickup,
        FrictionPickup,
        LineTone,
        RailCurvature,
        BeltTilt,
        ViscousTilt,
        ReversalRock,
        BeltTooth,
        SpeedNoise,
        MagPosition,
        MagMotor,
        EncoderScale,
    )
}

__all__ = ["EFFECTS", "Effect", "parse_effect", "parse_effects"]


def parse_effect(text: str) -> Effect:
    """Reads one NAME=VALUE; raises ValueError with one line that says what is wrong and what is known."""
    name, separator, number = text.partition("=")
    name = name.strip()
    if not separator:
        raise ValueError(f"effect {text!r}: write NAME=VALUE; known names: {', '.join(sorted(EFFECTS))}")
    if name not in EFFECTS:
        raise ValueError(f"effect {name!r} is unknown; known names: {', '.join(sorted(EFFECTS))}")
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ValueError(f"effect {name}: {number.strip()!r} is not a finite number")
    return EFFECTS[name](value)


def parse_effects(texts: Iterable[str]) -> tuple[Effect, ...]:
    """Reads several NAME=VALUE; each name at most once."""
    effects = tuple(parse_effect(text) for text in texts)
    names = [effect.name for effect in effects]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"effect {name} is given {names.count(name)} times: give it once")
    return effects
