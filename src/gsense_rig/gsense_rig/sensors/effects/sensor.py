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


class GCubed(GyroTerm):
    """Stiffening of the suspension, c a^3 along the sensor's own axes; (rad/s)/(m/s^2)^3."""

    name: ClassVar[str] = "g_cubed"
    driver: ClassVar[GyroDriver] = GyroDriver.ACCELERATION_CUBED


class GResonance(GyroTerm):
    """c times the sway by which the mount (9 Hz, damping 0.08) answers an acceleration; (rad/s)/(m/s^2)."""

    name: ClassVar[str] = "g_resonance"
    driver: ClassVar[GyroDriver] = GyroDriver.SWAY


@dataclass(frozen=True)
class AccelClipping:
    """Accelerometers that stand at a level; m/s^2."""

    value: float
    name: ClassVar[str] = "accel_clipping"

    def apply(self, model: SignalModel) -> None:
        """Sets the level."""
        model.accel_limit = _positive(self.name, self.value)


@dataclass(frozen=True)
class GyroClipping:
    """Gyros that stand at a level; rad/s."""

    value: float
    name: ClassVar[str] = "gyro_clipping"

    def apply(self, model: SignalModel) -> None:
        """Sets the level."""
        model.gyro_limit = _positive(self.name, self.value)


@dataclass(frozen=True)
class Quantization:
    """Gyros that know only multiples of a step (to whole LSB of the register); rad/s."""

    value: float
    name: ClassVar[str] = "quantization"

    def apply(self, model: SignalModel) -> None:
        """Sets the step."""
        model.gyro_step = _positive(self.name, self.value)


def _positive(name: str, value: float) -> float:
    if value <= 0:
        raise ValueError(f"{name} must be above zero, SI")
    return value


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
