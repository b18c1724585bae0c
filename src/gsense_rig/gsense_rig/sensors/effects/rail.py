"""Effects of the rig: the carriage truly rotates, so and gyros and accelerometers see it; the encoder's metres."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gsense_rig.sensors.drivers import FieldDriver, GyroDriver, TiltDriver
from gsense_rig.sensors.effects.base import FieldTerm, TiltTerm
from gsense_rig.sensors.model import SignalModel

LARGEST_SCALE = 0.5


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


class ReversalRock(TiltTerm):
    """Play of the bearings: within the first 0.2 mm after a reversal the carriage leans over; rad, half the play."""

    name: ClassVar[str] = "reversal_rock"
    driver: ClassVar[TiltDriver] = TiltDriver.PLAY


class BeltTooth(TiltTerm):
    """The teeth of the belt, 5 mm apart, shake the carriage about every axis of the rail; rad/s at any speed."""

    name: ClassVar[str] = "belt_tooth"
    driver: ClassVar[TiltDriver] = TiltDriver.TOOTH


@dataclass(frozen=True)
class SpeedNoise:
    """Rolling of the bearings: broadband angular rate whose strength follows the speed; rad/s (rms) at 1 m/s.

    It is wider than the sensors' filters, which take their part of it.
    """

    value: float
    name: ClassVar[str] = "speed_noise"

    def apply(self, model: SignalModel) -> None:
        """Lets every axis rattle by itself."""
        if self.value < 0:
            raise ValueError("speed_noise is a standard deviation: it cannot be negative")
        for axis in range(3):
            model.gyro_terms[:, axis, GyroDriver.RATTLE_X + axis] += self.value


class MagPosition(FieldTerm):
    """Steel along the rail: the field changes with the position; T/m on each axis of the rail."""

    name: ClassVar[str] = "mag_position"
    driver: ClassVar[FieldDriver] = FieldDriver.POSITION


@dataclass(frozen=True)
class EncoderScale:
    """A pulley larger than the counts per metre say: the encoder reads (1 + value) metres of every one; 1."""

    value: float
    name: ClassVar[str] = "encoder_scale"

    def apply(self, model: SignalModel) -> None:
        """Sets what the recorded positions are multiplied by; the carriage moves as it would."""
        if abs(self.value) > LARGEST_SCALE:
            raise ValueError(f"encoder_scale must be within +-{LARGEST_SCALE}")
        model.encoder_scale += self.value
