"""Mahony's filter: a proportional-integral observer on the rotations.

Source: R. Mahony, T. Hamel, J.-M. Pflimlin, "Nonlinear complementary filters on the special orthogonal group", IEEE
Trans. Automatic Control 53(5), 2008, the explicit filter (equations 32): the rate is corrected by the cross products of
measured and predicted directions, and their integral is the gyro's bias.

The magnetic direction is compared with a field of the same inclination that points north, as Madgwick does, so it
needs no knowledge of the place. It comes more seldom than the rate: its correction acts for the time since the last.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt

import numpy as np

from gsense_fusion.compiling import kernel

from .compiled import CompiledFilter, require_not_negative, unit_quaternion
from .entries import entries
from .interface import FloatArray
from .kernels import (
    SIGNATURE_STEP,
    length,
    to_earth,
    turn,
)


@dataclass(frozen=True)
class MahonyParameters:
    """Gains of the filter."""

    kp: float = 0.5
    """1/s, proportional gain: how fast the attitude follows accelerometer and magnetometer; 1 / kp is the time
    constant. Large lets linear accelerations in, small lets the gyro drift."""
    ki: float = 0.01
    """1/s^2, integral gain: how fast the bias is learnt. Large makes it swing with linear accelerations."""
    longest_field_s: float = 0.2
    """s: after a pause of the magnetometer its next correction counts for no longer than this."""

    def __post_init__(self) -> None:
        require_not_negative("mahony", kp=self.kp, ki=self.ki, longest_field_s=self.longest_field_s)


@dataclass
class MahonyState:
    """What the filter remembers."""

    quaternion: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Body -> ENU, (w, x, y, z), shape (4,)."""
    bias: FloatArray = field(default_factory=lambda: np.zeros(3))
    """rad/s, shape (3,): what is left of the gyro's bias in the rate handed over."""
    field_age_s: float = 0.0
    """Time since the last magnetic field, s."""


_BIAS, _AGE, _KP, _KI, _LONGEST = 4, 7, 8, 9, 10


@kernel(SIGNATURE_STEP)
def _step(m, q, dt, rate, force, mag, has_field):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    w, x, y, z = q
    vx, vy, vz = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)  # up, in the body
    m[_AGE] += dt
    ex = ey = ez = 0.0  # correction, integrated over dt: rad
    norm = length(force)
    if norm > 0.0:
        scale = dt / norm
        fx, fy, fz = force[0] * scale, force[1] * scale, force[2] * scale
        ex, ey, ez = fy * vz - fz * vy, fz * vx - fx * vz, fx * vy - fy * vx
    if has_field and length(mag) > 0.0:
        strength = length(mag)
        mx, my, mz = mag[0] / strength, mag[1] / strength, mag[2] / strength
        hx, hy, hz = to_earth(q, (mx, my, mz))
        north = sqrt(hx * hx + hy * hy)
        bx = 2.0 * north * (x * y + w * z) + hz * vx  # [0, north, hz] in the body
        by = north * (1.0 - 2.0 * (x * x + z * z)) + hz * vy
        bz = 2.0 * north * (y * z - w * x) + hz * vz
        age = min(m[_AGE], m[_LONGEST])
        ex += age * (my * bz - mz * by)
        ey += age * (mz * bx - mx * bz)
        ez += age * (mx * by - my * bx)
        m[_AGE] = 0.0
    m[_BIAS] -= m[_KI] * ex
    m[_BIAS + 1] -= m[_KI] * ey
    m[_BIAS + 2] -= m[_KI] * ez
    kp = m[_KP]
    angle = (
        dt * (rate[0] - m[_BIAS]) + kp * ex,
        dt * (rate[1] - m[_BIAS + 1]) + kp * ey,
        dt * (rate[2] - m[_BIAS + 2]) + kp * ez,
    )
    return turn(q, 1.0, angle)


_ENTRIES = entries(_step, "mahony")


class Mahony(CompiledFilter):
    """Mahony's filter, compiled; the field is used in the samples that come with one."""

    name = "mahony"
    _imu = staticmethod(_ENTRIES.imu)
    _field = staticmethod(_ENTRIES.field)
    _batch = staticmethod(_ENTRIES.batch)

    def __init__(self, parameters: MahonyParameters | None = None, state: MahonyState | None = None) -> None:
        super().__init__(np.zeros(11))
        self.parameters = p = parameters or MahonyParameters()
        self._memory[_KP:] = p.kp, p.ki, p.longest_field_s
        self.state = state or MahonyState()

    @property
    def state(self) -> MahonyState:
        """What the filter remembers, a copy."""
        return MahonyState(self.quaternion, self._memory[_BIAS : _BIAS + 3].copy(), float(self._memory[_AGE]))

    @state.setter
    def state(self, value: MahonyState) -> None:
        self._memory[:4] = unit_quaternion(value.quaternion)
        self._memory[_BIAS : _BIAS + 3] = value.bias
        self._memory[_AGE] = value.field_age_s
