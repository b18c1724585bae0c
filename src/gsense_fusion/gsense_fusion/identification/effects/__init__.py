"""The catalogue of effects: one file an effect; adding one touches its file and the list below."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.effects.g_sensitivity import GSensitivity
from gsense_fusion.identification.effects.rail_curvature import RailCurvature
from gsense_fusion.identification.effects.temperature_bias import TemperatureBias
from gsense_fusion.identification.effects.time_offset import TimeOffset

CATALOGUE: tuple[Effect, ...] = (GSensitivity(), TemperatureBias(), RailCurvature(), TimeOffset())
"""Every effect that can be named; `bias` is always declared and has no unit of its own."""


def by_name(catalogue: tuple[Effect, ...] = CATALOGUE) -> dict[str, Effect]:
    """The effects of a catalogue by their names."""
    return {effect.name: effect for effect in catalogue}
