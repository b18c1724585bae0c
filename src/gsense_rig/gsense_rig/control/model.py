"""The drive's inverse: which voltage makes the carriage move as wanted."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gsense_rig.plant.parameters import DriveParameters

_REVERSAL_SPEED = 1.0e-3  # m/s over which the dry friction's sign is blended; a wider blend shakes the carriage


@dataclass(frozen=True)
class DriveNeed:
    """What a motion asks of the drive."""

    voltage: float  # V
    current: float  # A


class DriveModel:
    """Rigid inverse model of motor, gear, belt and carriage with the controller's own (possibly wrong) numbers.

    Attributes:
        inertia: volts per acceleration [V/(m/s²)].
        decay: rate at which the back EMF brakes [1/s].
    """

    def __init__(self, drive: DriveParameters) -> None:
        self.drive = drive
        self._c = drive.force_constant
        self._r = drive.resistance
        self._eta = drive.gear_efficiency
        self._m_motor = drive.motor_mass
        self._m_load = drive.load_mass
        self._motor_coulomb = drive.motor_coulomb
        self._motor_viscous = drive.motor_viscous
        self._coulomb = drive.coulomb_friction
        self._viscous = drive.viscous_friction
        mass = drive.load_mass + drive.gear_efficiency * drive.motor_mass
        self.inertia = drive.resistance * mass / (drive.gear_efficiency * drive.force_constant)
        self.decay = drive.force_constant / self.inertia

    def need(self, velocity: float, acceleration: float) -> DriveNeed:
        """Voltage and current for a velocity [m/s] and an acceleration [m/s²] at the belt (L di/dt neglected)."""
        current = self._current(velocity, acceleration)
        return DriveNeed(voltage=self._r * current + self._c * velocity, current=current)

    def voltage(self, velocity: float, acceleration: float) -> float:
        """Terminal voltage [V] for a motion."""
        return self._r * self._current(velocity, acceleration) + self._c * velocity

    def _current(self, v: float, a: float) -> float:
        sign = math.tanh(v / _REVERSAL_SPEED)
        load = self._m_load * a + self._coulomb * sign + self._viscous * v
        load = load / self._eta if load * v >= 0.0 else load * self._eta
        return (load + self._m_motor * a + self._motor_coulomb * sign + self._motor_viscous * v) / self._c

    def acceleration(self, velocity: float, voltage: float | None) -> float:
        """Acceleration [m/s²] that a voltage makes at a velocity; None: bridge open, no current."""
        v = velocity
        current = 0.0 if voltage is None else (voltage - self._c * v) / self._r
        sign = math.tanh(v / _REVERSAL_SPEED)
        motor = self._c * current - self._motor_coulomb * sign - self._motor_viscous * v
        load = self._coulomb * sign + self._viscous * v
        eta = self._eta
        a = (eta * motor - load) / (self._m_load + eta * self._m_motor)
        if (motor - self._m_motor * a) * v < 0.0:
            a = (motor / eta - load) / (self._m_load + self._m_motor / eta)
        return a

    def force(self, current: float, velocity: float) -> float:
        """Force of the drive on the belt [N] at a measured current [A], gear loss included."""
        raw = self._c * current
        return raw * self._eta if raw * velocity >= 0.0 else raw / self._eta

    def duty(self, voltage: float) -> float:
        """Signed duty for a voltage, the bridge's dead zone undone; clipped to -1..1."""
        share = voltage / self.drive.supply_voltage
        if share == 0.0:
            return 0.0
        size = self.drive.dead_zone + abs(share) * (1.0 - self.drive.dead_zone)
        return math.copysign(min(size, 1.0), share)

    def duty_voltage(self, duty: float) -> float:
        """Terminal voltage [V] that a duty makes."""
        size = abs(duty) - self.drive.dead_zone
        if size <= 0.0:
            return 0.0
        return math.copysign(size / (1.0 - self.drive.dead_zone) * self.drive.supply_voltage, duty)
