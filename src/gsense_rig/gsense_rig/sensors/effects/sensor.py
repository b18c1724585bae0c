"""Effects that the sensor itself owns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from gsense_rig.sensors.drivers import Chip, GyroDriver
from gsense_rig.sensors.effects.base import GyroTerm
from gsense_rig.sensors.model import FORCE, SignalModel
from gsense_rig.sensors.parameters import thesis_g_matrix


@dataclass(frozen=True)
class Bias:
    """Replaces the units' own biases; rad/s on each axis."""

    value: float
    name: ClassVar[str] = "bias"

    def apply(self, model: SignalModel) -> None:
        """Sets every gyro's bias."""
        model.gyro_terms[:, :, GyroDriver.ONE] = self.value


@dataclass(frozen=True)
class GSensitivity:
    """Replaces the units' own G by the thesis's scalar k (eq. 7.4); (rad/s)/(m/s^2)."""

    value: float
    name: ClassVar[str] = "g_sensitivity"

    def apply(self, model: SignalModel) -> None:
        """Sets every gyro's G."""
        for chip in Chip:
            model.gyro_terms[chip, :, FORCE] = thesis_g_matrix(self.value)


class TemperatureBias(GyroTerm):
    """c (T - 25 degC), T the lagged die temperature; rad/s/K."""

    name: ClassVar[str] = "temperature_bias"
    driver: ClassVar[GyroDriver] = GyroDriver.WARMTH


class GSquared(GyroTerm):
    """Vibration rectification, c a^2; (rad/s)/(m/s^2)^2."""

    name: ClassVar[str] = "g_squared"
    driver: ClassVar[GyroDriver] = GyroDriver.ACCELERATION_SQUARED


class BiasJump(GyroTerm):
    """A step of the bias in mid-session (BNO055 background calibration); rad/s."""

    name: ClassVar[str] = "bias_jump"
    driver: ClassVar[GyroDriver] = GyroDriver.JUMP


@dataclass(frozen=True)
class BiasDrift:
    """Rate random walk of the gyros in place of their own; (rad/s)/sqrt(s)."""

    value: float
    name: ClassVar[str] = "bias_drift"

    def apply(self, model: SignalModel) -> None:
        """Sets the random walk."""
        if self.value < 0:
            raise ValueError("bias_drift is a density: it cannot be negative")
        model.random_walk[:] = self.value


@dataclass(frozen=True)
class JerkCoupling:
    """K_j times the derivative of the specific force, of every axis into every gyro axis; (rad/s)/(m/s^3)."""

    value: float
    name: ClassVar[str] = "jerk_coupling"

    def apply(self, model: SignalModel) -> None:
        """Couples the jerk of every axis into every gyro axis."""
        model.gyro_terms[:, :, GyroDriver.JERK_X : GyroDriver.JERK_Z + 1] += self.value
