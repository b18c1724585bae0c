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
from math import cos, isfinite, sin, sqrt

import numpy as np
from numba import njit

from .interface import FloatArray

_NO_FIELD = np.full(3, np.nan)
_SIGNATURE = "void(f8[::1], f8, f8[::1], f8[::1], f8[::1], f8, f8)"


@dataclass(frozen=True)
class MadgwickParameters:
    """Gains of the filter."""

    beta_imu: float = 0.033
    """rad/s: how fast the attitude is pulled towards gravity. The report's optimum for IMU (a gyro error of 2.2 deg/s
    by equation 50). Larger follows gravity faster and lets linear accelerations in; smaller trusts the gyro."""
    beta_marg: float = 0.041
    """rad/s: the same for gravity and magnetic field together. The report's optimum for MARG."""

    def __post_init__(self) -> None:
        for name, value in (("beta_imu", self.beta_imu), ("beta_marg", self.beta_marg)):
            if not (isfinite(value) and value >= 0):
                raise ValueError(f"madgwick: {name} must be a number of 0 or more, not {value}")


@dataclass
class MadgwickState:
    """What the filter remembers."""

    quaternion: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Body -> ENU, (w, x, y, z), shape (4,)."""


class Madgwick:
    """Madgwick's filter, compiled; MARG for the samples that come with a field, IMU for the others."""

    def __init__(self, parameters: MadgwickParameters | None = None, state: MadgwickState | None = None) -> None:
        self.parameters = parameters or MadgwickParameters()
        self.state = state or MadgwickState()

    @property
    def quaternion(self) -> FloatArray:
        """Attitude, body -> ENU, shape (4,), a copy."""
        return self.state.quaternion.copy()

    @quaternion.setter
    def quaternion(self, value: FloatArray) -> None:
        value = np.array(value, dtype=np.float64)
        self.state.quaternion = value / np.linalg.norm(value)

    def update(
        self, dt: float, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None = None
    ) -> FloatArray:
        """One sample; see `AttitudeFilter.update`. Arrays are C-contiguous float64."""
        gains = self.parameters
        _step(
            self.state.quaternion,
            dt,
            angular_rate,
            specific_force,
            _NO_FIELD if field is None else field,
            gains.beta_imu,
            gains.beta_marg,
        )
        return self.state.quaternion.copy()

    def batch(
        self, dt: FloatArray, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None = None
    ) -> FloatArray:
        """Many samples; see `AttitudeFilter.batch`."""
        rate = np.ascontiguousarray(angular_rate, dtype=np.float64)
        force = np.ascontiguousarray(specific_force, dtype=np.float64)
        fields = np.empty((0, 3)) if field is None else np.ascontiguousarray(field, dtype=np.float64)
        steps = np.ascontiguousarray(dt, dtype=np.float64)
        shape = (len(steps), 3)
        if rate.shape != shape or force.shape != shape or (field is not None and fields.shape != shape):
            raise ValueError(
                f"madgwick: dt {steps.shape}, rate {rate.shape}, force {force.shape}, field {fields.shape}"
            )
        gains = self.parameters
        return np.asarray(
            _batch(self.state.quaternion, steps, rate, force, fields, gains.beta_imu, gains.beta_marg), dtype=np.float64
        )


@njit(_SIGNATURE, cache=True)
def _step(q, dt, rate, force, mag, beta_imu, beta_marg):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    w, x, y, z = q[0], q[1], q[2], q[3]

    # gyro: q turned by the rate over dt, the exact solution of eq. 12
    turn = sqrt(rate[0] * rate[0] + rate[1] * rate[1] + rate[2] * rate[2])
    half = 0.5 * turn * dt
    s = 0.5 * dt if half < 1e-9 else sin(half) / turn
    c, sx, sy, sz = cos(half), s * rate[0], s * rate[1], s * rate[2]
    pw = w * c - x * sx - y * sy - z * sz
    px = w * sx + x * c + y * sz - z * sy
    py = w * sy - x * sz + y * c + z * sx
    pz = w * sz + x * sy - y * sx + z * c

    norm = sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
    if norm > 0.0 and isfinite(norm):
        # objective of gravity, eq. 25: the vertical as the attitude predicts it minus as measured
        f1 = 2.0 * (x * z - w * y) - force[0] / norm
        f2 = 2.0 * (w * x + y * z) - force[1] / norm
        f3 = 1.0 - 2.0 * (x * x + y * y) - force[2] / norm
        # gradient J^T f with the Jacobian of eq. 26
        gw = -2.0 * y * f1 + 2.0 * x * f2
        gx = 2.0 * z * f1 + 2.0 * w * f2 - 4.0 * x * f3
        gy = -2.0 * w * f1 + 2.0 * z * f2 - 4.0 * y * f3
        gz = 2.0 * x * f1 + 2.0 * y * f2
        beta = beta_imu

        strength = sqrt(mag[0] * mag[0] + mag[1] * mag[1] + mag[2] * mag[2])
        if strength > 0.0 and isfinite(strength):
            beta = beta_marg
            mx, my, mz = mag[0] / strength, mag[1] / strength, mag[2] / strength
            # the field in the earth frame, eq. 45
            ex = (1.0 - 2.0 * (y * y + z * z)) * mx + 2.0 * (x * y - w * z) * my + 2.0 * (x * z + w * y) * mz
            ey = 2.0 * (x * y + w * z) * mx + (1.0 - 2.0 * (x * x + z * z)) * my + 2.0 * (y * z - w * x) * mz
            # its reference: the same inclination, no declination, eq. 46 (here [0, by, bz]: y is north)
            by = sqrt(ex * ex + ey * ey)
            bz = 2.0 * (x * z - w * y) * mx + 2.0 * (w * x + y * z) * my + (1.0 - 2.0 * (x * x + y * y)) * mz
            # objective of the field, eq. 29
            h1 = 2.0 * by * (x * y + w * z) + 2.0 * bz * (x * z - w * y) - mx
            h2 = by * (1.0 - 2.0 * (x * x + z * z)) + 2.0 * bz * (w * x + y * z) - my
            h3 = 2.0 * by * (y * z - w * x) + bz * (1.0 - 2.0 * (x * x + y * y)) - mz
            # the field's part of J^T f, eq. 30 to 32
            gw += 2.0 * (by * z - bz * y) * h1 + 2.0 * bz * x * h2 - 2.0 * by * x * h3
            gx += 2.0 * (by * y + bz * z) * h1 + (2.0 * bz * w - 4.0 * by * x) * h2 - (2.0 * by * w + 4.0 * bz * x) * h3
            gy += 2.0 * (by * x - bz * w) * h1 + 2.0 * bz * z * h2 + (2.0 * by * z - 4.0 * bz * y) * h3
            gz += 2.0 * (by * w + bz * x) * h1 + (2.0 * bz * y - 4.0 * by * z) * h2 + 2.0 * by * y * h3

        slope = sqrt(gw * gw + gx * gx + gy * gy + gz * gz)
        if slope > 0.0:
            # eq. 42 to 44: one step of length beta dt against the gradient
            gain = beta * dt / slope
            pw -= gain * gw
            px -= gain * gx
            py -= gain * gy
            pz -= gain * gz

    norm = sqrt(pw * pw + px * px + py * py + pz * pz)
    q[0], q[1], q[2], q[3] = pw / norm, px / norm, py / norm, pz / norm


@njit("f8[:, ::1](f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8, f8)", cache=True)
def _batch(q, dt, rate, force, mag, beta_imu, beta_marg):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    out = np.empty((dt.shape[0], 4))
    none = np.full(3, np.nan)
    for i in range(dt.shape[0]):
        _step(q, dt[i], rate[i], force[i], mag[i] if mag.shape[0] > 0 else none, beta_imu, beta_marg)
        out[i] = q
    return out
