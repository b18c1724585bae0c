"""The Kalman filter of the thesis's chapter 5.2: an angle and the bias of its gyro, one filter an axis.

    x = [angle, bias]       A = [1 -dt; 0 1]    B = [dt; 0]    C = [1 0]       equations 5.10 to 5.13
    x_k = A x_(k-1) + B rate + w,  Q = diag(q_angle, q_bias) dt                equations 5.9, 5.14
    y_k = C x_k + v,               R the variance of the measured angle        equations 5.7, 5.15

The thesis writes it for one angle "and alike for the others". Three filters for roll, pitch and yaw would need their
rates from equation 4.5, which has no value at the gimbal lock; here the three angles are the small turns about the
body's own axes since the last correction, after which they are handed to the quaternion and set to zero. About one
horizontal axis that is, number by number, the filter of the thesis (and filterpy's: the tests compare).

What an accelerometer says about an axis is the less the nearer that axis is to the vertical (cosine v): its variance
is R / (1 - v^2), that of the magnetic heading R_heading / v^2.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from gsense_fusion.compiling import kernel

from .compiled import CompiledFilter, require_not_negative, require_positive, unit_quaternion
from .entries import entries
from .interface import FloatArray
from .kernels import (
    SIGNATURE_STEP,
    heading_error,
    length,
    tilt_error,
    turn,
)


@dataclass(frozen=True)
class KalmanParameters:
    """Noise of the model and of the measurements; per sample, as in the thesis."""

    angle_density: float = radians(0.05)
    """rad/sqrt(s), square root of q_angle: noise of the gyro, with what its scale leaves."""
    bias_density: float = radians(0.002)
    """rad/s/sqrt(s), square root of q_bias: how fast the bias wanders. Large: the bias swings with accelerations."""
    angle_deviation: float = radians(10.0)
    """rad, square root of R: the accelerometer's angle. By far not its noise: linear accelerations are the error."""
    heading_deviation: float = radians(10.0)
    """rad, of the magnetic heading."""
    initial_angle_deviation: float = radians(1.0)
    """rad."""
    initial_bias_deviation: float = radians(0.05)
    """rad/s: the bias at the start was taken from a second at rest."""

    def __post_init__(self) -> None:
        require_not_negative("kalman", angle_density=self.angle_density, bias_density=self.bias_density)
        require_not_negative("kalman", initial_angle_deviation=self.initial_angle_deviation)
        require_not_negative("kalman", initial_bias_deviation=self.initial_bias_deviation)
        require_positive("kalman", angle_deviation=self.angle_deviation, heading_deviation=self.heading_deviation)


@dataclass
class KalmanState:
    """What the filter remembers."""

    quaternion: FloatArray
    """Body -> ENU, (w, x, y, z), shape (4,)."""
    bias: FloatArray
    """rad/s, shape (3,): what is left of the gyro's bias in the rate handed over."""
    covariance: FloatArray
    """Of angle and bias, each axis: p11, p12, p22; shape (3, 3)."""


_BIAS, _P, _Q_ANGLE, _Q_BIAS, _R, _R_HEADING = 4, 7, 16, 17, 18, 19


@kernel("f8(f8[::1], i8, f8, f8)")
def _correct(m, axis, innovation, variance):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Measurement of one angle, C = [1 0]; the bias is corrected, the angle's correction returned."""
    at = _P + 3 * axis
    p11, p12, p22 = m[at], m[at + 1], m[at + 2]
    k1, k2 = p11 / (p11 + variance), p12 / (p11 + variance)
    m[at] = (1.0 - k1) * p11
    m[at + 1] = (1.0 - k1) * p12
    m[at + 2] = p22 - k2 * p12
    m[_BIAS + axis] += k2 * innovation
    return k1 * innovation


@kernel(SIGNATURE_STEP)
def _step(m, q, dt, rate, force, mag, has_field):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    q = turn(q, dt, (rate[0] - m[_BIAS], rate[1] - m[_BIAS + 1], rate[2] - m[_BIAS + 2]))  # equation 5.14
    for axis in range(3):
        at = _P + 3 * axis  # A P A' + Q
        m[at] += dt * (dt * m[at + 2] - 2.0 * m[at + 1] + m[_Q_ANGLE])
        m[at + 1] -= dt * m[at + 2]
        m[at + 2] += dt * m[_Q_BIAS]
    w, x, y, z = q
    up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    tx = ty = tz = 0.0
    if length(force) > 0.0:
        ex, ey, _ = tilt_error(q, force)
        # the turn's axis is horizontal: earth -> body
        bx = ex * (1.0 - 2.0 * (y * y + z * z)) + ey * 2.0 * (x * y + w * z)
        by = ex * 2.0 * (x * y - w * z) + ey * (1.0 - 2.0 * (x * x + z * z))
        bz = ex * 2.0 * (x * z + w * y) + ey * 2.0 * (y * z - w * x)
        floor = 1e-6
        tx = _correct(m, 0, bx, m[_R] / max(1.0 - up[0] * up[0], floor))
        ty = _correct(m, 1, by, m[_R] / max(1.0 - up[1] * up[1], floor))
        tz = _correct(m, 2, bz, m[_R] / max(1.0 - up[2] * up[2], floor))
    if has_field and length(mag) > 0.0:
        turned = heading_error(q, mag)
        floor = 1e-6
        tx += _correct(m, 0, turned * up[0], m[_R_HEADING] / max(up[0] * up[0], floor))
        ty += _correct(m, 1, turned * up[1], m[_R_HEADING] / max(up[1] * up[1], floor))
        tz += _correct(m, 2, turned * up[2], m[_R_HEADING] / max(up[2] * up[2], floor))
    return turn(q, 1.0, (tx, ty, tz))


_ENTRIES = entries(_step, "kalman")


class Kalman(CompiledFilter):
    """The thesis's Kalman filter on three axes, compiled."""

    name = "kalman"
    _imu = staticmethod(_ENTRIES.imu)
    _field = staticmethod(_ENTRIES.field)
    _batch = staticmethod(_ENTRIES.batch)

    def __init__(self, parameters: KalmanParameters | None = None, state: KalmanState | None = None) -> None:
        super().__init__(np.zeros(20))
        self.parameters = p = parameters or KalmanParameters()
        self._memory[_Q_ANGLE:] = (
            p.angle_density**2,
            p.bias_density**2,
            p.angle_deviation**2,
            p.heading_deviation**2,
        )
        self.state = state or self._initial()

    def _initial(self) -> KalmanState:
        p = self.parameters
        row = [p.initial_angle_deviation**2, 0.0, p.initial_bias_deviation**2]
        return KalmanState(np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), np.tile(row, (3, 1)))

    @property
    def state(self) -> KalmanState:
        """What the filter remembers, a copy."""
        return KalmanState(
            self.quaternion,
            self._memory[_BIAS:_P].copy(),
            self._memory[_P:_Q_ANGLE].reshape(3, 3).copy(),
        )

    @state.setter
    def state(self, value: KalmanState) -> None:
        self._memory[:4] = unit_quaternion(value.quaternion)
        self._memory[_BIAS:_P] = value.bias
        self._memory[_P:_Q_ANGLE] = np.asarray(value.covariance, dtype=np.float64).reshape(9)
