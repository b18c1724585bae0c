"""Madgwick's gradient-descent filter for IMU and MARG.

Source: S. O. H. Madgwick, "An efficient orientation filter for inertial and inertial/magnetic sensor arrays", report,
University of Bristol, 2010; equation numbers below are the report's. Two things differ from the code that was published
with it, on purpose:

- The published C code lacks a factor 2 in bx and bz (its `_2bx` holds bx, equation 46), which weakens and bends the
  magnetic correction. Here equations 45 and 46 are used as they stand.
- The gyro's part (equations 12, 13) is integrated by the exact turn of a constant rate, not by one Euler step, so long
  intervals and fast turns cost nothing.

The report's earth frame has its x axis north; here it is east-north-up, so the reference of the field is [0, b_y, b_z].
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt

import numpy as np

from gsense_fusion.compiling import kernel

from .compiled import CompiledFilter, require_not_negative, unit_quaternion
from .entries import entries
from .interface import FloatArray
from .kernels import QUATERNION, SIGNATURE_STEP, VECTOR, length, turn


@dataclass(frozen=True)
class MadgwickParameters:
    """Gains of the filter."""

    beta_imu: float = 0.033
    """rad/s: how fast the attitude is pulled towards gravity. The report's optimum for IMU (a gyro error of 2.2 deg/s
    by equation 50). Larger follows gravity faster and lets linear accelerations in; smaller trusts the gyro."""
    beta_marg: float = 0.041
    """rad/s: the same for gravity and magnetic field together. The report's optimum for MARG."""

    def __post_init__(self) -> None:
        require_not_negative("madgwick", beta_imu=self.beta_imu, beta_marg=self.beta_marg)


@dataclass
class MadgwickState:
    """What the filter remembers."""

    quaternion: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Body -> ENU, (w, x, y, z), shape (4,)."""


_BETA_IMU, _BETA_MARG = 4, 5


@kernel(f"{QUATERNION}({QUATERNION}, {VECTOR})")
def _gravity_gradient(q, up):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """J^T f with the Jacobian of eq. 26; `up` is the measured vertical, a unit vector."""
    w, x, y, z = q
    # objective, eq. 25: the vertical as the attitude predicts it minus as measured
    f1 = 2.0 * (x * z - w * y) - up[0]
    f2 = 2.0 * (w * x + y * z) - up[1]
    f3 = 1.0 - 2.0 * (x * x + y * y) - up[2]
    return (
        -2.0 * y * f1 + 2.0 * x * f2,
        2.0 * z * f1 + 2.0 * w * f2 - 4.0 * x * f3,
        -2.0 * w * f1 + 2.0 * z * f2 - 4.0 * y * f3,
        2.0 * x * f1 + 2.0 * y * f2,
    )


@kernel(f"{QUATERNION}({QUATERNION}, {VECTOR})")
def _field_gradient(q, field):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """The field's part of J^T f, eq. 30 to 32; `field` is a unit vector."""
    w, x, y, z = q
    mx, my, mz = field
    # the field in the earth frame, eq. 45
    ex = (1.0 - 2.0 * (y * y + z * z)) * mx + 2.0 * (x * y - w * z) * my + 2.0 * (x * z + w * y) * mz
    ey = 2.0 * (x * y + w * z) * mx + (1.0 - 2.0 * (x * x + z * z)) * my + 2.0 * (y * z - w * x) * mz
    # its reference: the same inclination, no declination, eq. 46 (here [0, by, bz]: y is north)
    by = sqrt(ex * ex + ey * ey)
    bz = 2.0 * (x * z - w * y) * mx + 2.0 * (w * x + y * z) * my + (1.0 - 2.0 * (x * x + y * y)) * mz
    # objective, eq. 29
    h1 = 2.0 * by * (x * y + w * z) + 2.0 * bz * (x * z - w * y) - mx
    h2 = by * (1.0 - 2.0 * (x * x + z * z)) + 2.0 * bz * (w * x + y * z) - my
    h3 = 2.0 * by * (y * z - w * x) + bz * (1.0 - 2.0 * (x * x + y * y)) - mz
    return (
        2.0 * (by * z - bz * y) * h1 + 2.0 * bz * x * h2 - 2.0 * by * x * h3,
        2.0 * (by * y + bz * z) * h1 + (2.0 * bz * w - 4.0 * by * x) * h2 - (2.0 * by * w + 4.0 * bz * x) * h3,
        2.0 * (by * x - bz * w) * h1 + 2.0 * bz * z * h2 + (2.0 * by * z - 4.0 * bz * y) * h3,
        2.0 * (by * w + bz * x) * h1 + (2.0 * bz * y - 4.0 * by * z) * h2 + 2.0 * by * y * h3,
    )


@kernel(SIGNATURE_STEP)
def _step(m, q, dt, rate, force, mag, has_field):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    # gyro: q turned by the rate over dt, the exact solution of eq. 12; the gradient is taken before
    pw, px, py, pz = turn(q, dt, rate)

    norm = length(force)
    if norm > 0.0:
        scale = 1.0 / norm
        gw, gx, gy, gz = _gravity_gradient(q, (force[0] * scale, force[1] * scale, force[2] * scale))
        beta = m[_BETA_IMU]

        strength = length(mag)
        if has_field and strength > 0.0:
            beta = m[_BETA_MARG]
            hw, hx, hy, hz = _field_gradient(q, (mag[0] / strength, mag[1] / strength, mag[2] / strength))
            gw += hw
            gx += hx
            gy += hy
            gz += hz

        slope = sqrt(gw * gw + gx * gx + gy * gy + gz * gz)
        if slope > 0.0:
            # eq. 42 to 44: one step of length beta dt against the gradient
            gain = beta * dt / slope
            pw -= gain * gw
            px -= gain * gx
            py -= gain * gy
            pz -= gain * gz

    scale = 1.0 / sqrt(pw * pw + px * px + py * py + pz * pz)
    return (pw * scale, px * scale, py * scale, pz * scale)


_ENTRIES = entries(_step, "madgwick")


class Madgwick(CompiledFilter):
    """Madgwick's filter, compiled; MARG for the samples that come with a field, IMU for the others."""

    name = "madgwick"
    _imu = staticmethod(_ENTRIES.imu)
    _field = staticmethod(_ENTRIES.field)
    _batch = staticmethod(_ENTRIES.batch)

    def __init__(self, parameters: MadgwickParameters | None = None, state: MadgwickState | None = None) -> None:
        super().__init__(np.zeros(6))
        self.parameters = p = parameters or MadgwickParameters()
        self._memory[_BETA_IMU:] = p.beta_imu, p.beta_marg
        self.state = state or MadgwickState()

    @property
    def state(self) -> MadgwickState:
        """What the filter remembers, a copy."""
        return MadgwickState(self.quaternion)

    @state.setter
    def state(self, value: MadgwickState) -> None:
        self._memory[:4] = unit_quaternion(value.quaternion)
