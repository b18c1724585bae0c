"""Effects of the measuring chain: timing, transport, supply and electrical pick-up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gsense_rig.sensors.drivers import FieldDriver, GyroDriver
from gsense_rig.sensors.effects.base import FieldTerm, GyroTerm
from gsense_rig.sensors.model import SignalModel

LONGEST_OFFSET = 0.1
LARGEST_SKEW = 0.02
MOST_LOST = 0.9


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
    """A tone at 31.3 Hz while the motor has current, of its power stage seen through a slow sampler; rad/s.

    One that sounds at rest too would be noise of the session.
    """

    value: float
    name: ClassVar[str] = "line_tone"
    frequency: ClassVar[float] = 31.3

    def apply(self, model: SignalModel) -> None:
        """Adds the tone to every axis."""
        model.gyro_terms[:, :, GyroDriver.TONE] += self.value
        model.tone_frequency = self.frequency


class SupplyVoltage(GyroTerm):
    """c (V - 4.2 V), V the cell's voltage; (rad/s)/V."""

    name: ClassVar[str] = "supply_voltage"
    driver: ClassVar[GyroDriver] = GyroDriver.SUPPLY


class MagMotor(FieldTerm):
    """Stray field of the motor and its leads; T/A on each axis of the rail."""

    name: ClassVar[str] = "mag_motor"
    driver: ClassVar[FieldDriver] = FieldDriver.CURRENT


@dataclass(frozen=True)
class ClockSkew:
    """The board's stamps run faster than the rig's, as where nobody follows the board's oscillator; relative."""

    value: float
    name: ClassVar[str] = "clock_skew"

    def apply(self, model: SignalModel) -> None:
        """Lets the board's stamps run."""
        if abs(self.value) > LARGEST_SKEW:
            raise ValueError(f"clock_skew must be -{LARGEST_SKEW} to {LARGEST_SKEW}, relative (0.001 is 1000 ppm)")
        model.clock_error += self.value


@dataclass(frozen=True)
class SampleLoss:
    """Radio frames that never arrive, alone or a few in a row; their part of all."""

    value: float
    name: ClassVar[str] = "sample_loss"

    def apply(self, model: SignalModel) -> None:
        """Loses frames."""
        if not 0.0 <= self.value <= MOST_LOST:
            raise ValueError(f"sample_loss must be 0 to {MOST_LOST}, the part that is lost")
        model.lost = self.value
