"""Effects of the rig: the carriage truly rotates, so gyros see a rate and accelerometers see gravity tilt."""

from __future__ import annotations

from typing import ClassVar

from gsense_rig.sensors.drivers import TiltDriver
from gsense_rig.sensors.effects.base import TiltTerm


class RailCurvature(TiltTerm):
    """Bow and twist of the rail: attitude t s about each rail axis, and the bow's normal acceleration; rad/m."""

    name: ClassVar[str] = "rail_curvature"
    driver: ClassVar[TiltDriver] = TiltDriver.POSITION


class BeltTilt(TiltTerm):
    """The belt pulls above the carriage's centre: attitude c a; rad/(m/s^2)."""

    name: ClassVar[str] = "belt_tilt"
    driver: ClassVar[TiltDriver] = TiltDriver.ACCELERATION


class ViscousTilt(TiltTerm):
    """Attitude c v; rad/(m/s)."""

    name: ClassVar[str] = "viscous_tilt"
    driver: ClassVar[TiltDriver] = TiltDriver.SPEED
