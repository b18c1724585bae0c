"""Effects of the measuring chain: timing and electrical pick-up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gsense_rig.sensors.drivers import GyroDriver
from gsense_rig.sensors.effects.base import GyroTerm
from gsense_rig.sensors.model import SignalModel

LONGEST_OFFSET = 0.1


@dataclass(frozen=True)
class TimeOffset:
    """The gyros' whole path is later than the accelerometers'; s."""

    value: float
    name: ClassVar[str] = "time_offset"

    def apply(self, model: SignalModel) -> None:
        """Delays the gyros."""
        if not 0.0 <= self.value <= LONGEST_OFFSET:
            raise ValueError(f"time_offset must be 0 to {LONGEST_OFFSET} s")
        model.gyro_delay += self.value


class SpeedPickup(GyroTerm):
    """Pick-up of the motor's back-EMF, c v, with no real tilt; (rad/s)/(m/s)."""

    name: ClassVar[str] = "speed_pickup"
    driver: ClassVar[GyroDriver] = GyroDriver.SPEED


class FrictionPickup(GyroTerm):
    """Pick-up that follows the sign of the speed (motor current against friction); rad/s."""

    name: ClassVar[str] = "friction_pickup"
    driver: ClassVar[GyroDriver] = GyroDriver.DIRECTION


@dataclass(frozen=True)
class LineTone:
    """A tone at a fixed frequency; amplitude in rad/s. It sounds at 31.3 Hz: mains seen through a slow sampler."""

    value: float
    name: ClassVar[str] = "line_tone"
    frequency: ClassVar[float] = 31.3

    def apply(self, model: SignalModel) -> None:
        """Adds the tone to every axis."""
        model.gyro_terms[:, :, GyroDriver.TONE] += self.value
        model.tone_frequency = self.frequency
