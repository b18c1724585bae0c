"""What an effect is: one named deviation of the sensors or the rig, with one value, that changes the signal model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Protocol

from gsense_rig.sensors.drivers import FieldDriver, GyroDriver, TiltDriver
from gsense_rig.sensors.model import SignalModel


class Effect(Protocol):
    """Interface of the classes in this folder."""

    name: ClassVar[str]

    def __init__(self, value: float) -> None: ...

    @property
    def value(self) -> float:
        """VALUE, SI."""

    def apply(self, model: SignalModel) -> None:
        """Adds the effect to the model; raises ValueError where the value makes no sense."""


@dataclass(frozen=True)
class GyroTerm:
    """An effect that adds `value` times one driver on every axis of every gyro; subclasses name the driver."""

    value: float
    name: ClassVar[str]
    driver: ClassVar[GyroDriver]

    def apply(self, model: SignalModel) -> None:
        """Sets the driver's coefficient."""
        model.gyro_terms[:, :, self.driver] += self.value


@dataclass(frozen=True)
class TiltTerm:
    """A true rotation of the carriage: `value` times one driver about every axis of the rail."""

    value: float
    name: ClassVar[str]
    driver: ClassVar[TiltDriver]

    def apply(self, model: SignalModel) -> None:
        """Sets the driver's coefficient."""
        model.tilt[:, self.driver] += self.value


@dataclass(frozen=True)
class FieldTerm:
    """A change of the magnetic field: `value` times one driver on every axis of the rail."""

    value: float
    name: ClassVar[str]
    driver: ClassVar[FieldDriver]

    def apply(self, model: SignalModel) -> None:
        """Sets the driver's coefficient."""
        model.field[:, self.driver] += self.value
