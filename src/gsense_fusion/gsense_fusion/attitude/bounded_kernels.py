"""Compiled steps of the bounded-motion filter; the idea is told in `bounded`.

Error state: tilt about east and north (rad, earth frame; true = turn * estimate), bias (true - estimate, rad/s, body),
velocity (true - estimate, m/s, earth): 8 numbers.
"""

from __future__ import annotations

from math import atan2, exp, pi, sqrt

import numpy as np

from gsense_fusion.compiling import kernel

from .bounded_memory import Cell
from .kernels import (
    SIGNATURE_BATCH,
    SIGNATURE_FIELD,
    SIGNATURE_IMU,
    length,
    load,
    store,
    to_earth,
    turn,
    turn_earth,
    vector,
)

# numba takes integers as constants, not members of an enum
_K = int(Cell.KALMAN)
_B = int(Cell.BIAS)
_V = int(Cell.VELOCITY)
_P = int(Cell.COVARIANCE)
_F = int(Cell.FORCE_SUM)
_R = int(Cell.TURN_SUM)
_TIME = int(Cell.TIME)
_W2 = int(Cell.RATE_SQUARED)
_A2 = int(Cell.FORCE_SQUARED)
_WLOW = int(Cell.RATE_LOW)
_FLOW = int(Cell.FORCE_LOW)
_STARTED = int(Cell.STARTED)
_STILL = int(Cell.STILL_FOR)
_G = int(Cell.GRAVITY)
_DELTA = int(Cell.DELTA)
_AGE = int(Cell.FIELD_AGE)
_FIELDS = int(Cell.FIELDS)
_NORM = int(Cell.FIELD_NORM)
_DIP = int(Cell.FIELD_DIP)
_OFF = int(Cell.OFF_FOR)
_OFF_NORM = int(Cell.OFF_NORM)
_OFF_DIP = int(Cell.OFF_DIP)
_Q_RATE = int(Cell.Q_RATE)
_Q_RATE_SCALE = int(Cell.Q_RATE_SCALE)
_Q_FORCE = int(Cell.Q_FORCE)
_Q_FORCE_SCALE = int(Cell.Q_FORCE_SCALE)
_Q_BIAS = int(Cell.Q_BIAS)
_R_VELOCITY = int(Cell.R_VELOCITY)
_R_REST = int(Cell.R_REST)
_REST_RATE = int(Cell.REST_RATE)
_REST_FORCE = int(Cell.REST_FORCE)
_REST_S = int(Cell.REST_S)
_STEP_S = int(Cell.STEP_S)
_TAU = int(Cell.HEADING_TAU)
_STRENGTH = int(Cell.FIELD_STRENGTH)
_DIP_LIMIT = int(Cell.FIELD_DIP_LIMIT)
_NEW_S = int(Cell.FIELD_NEW_S)
_N = 8
_REST_TAU = 0.5
_FIELD_TAU = 20.0


@kernel("void(f8[:, ::1], f8[::1], i8, f8, f8)")
def _measure(p, dx, j, residual, variance):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """The error state's number j is measured: Kalman update of covariance and error."""
    gain = np.empty(_N)
    for a in range(_N):
        gain[a] = p[a, j] / (p[j, j] + variance)
    rest = residual - dx[j]
    row = p[j].copy()
    for a in range(_N):
        dx[a] += gain[a] * rest
        for b in range(_N):
            p[a, b] -= gain[a] * row[b]


@kernel("void(f8[::1], f8[:, ::1])")
def _predict(m, p):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Covariance over the time since the last correction: tilt' = -R bias, velocity' = -[R f]x tilt."""
    t = m[_TIME]
    sx, sy, sz = m[_F], m[_F + 1], m[_F + 2]
    step = np.eye(_N)
    for i in range(2):
        for j in range(3):
            step[i, 2 + j] = -m[_R + 3 * i + j]
    step[5, 1] = sz
    step[6, 0] = -sz
    step[7, 0] = sy
    step[7, 1] = -sx
    p[:] = step @ p @ step.T
    for i in range(2):
        p[i, i] += m[_Q_RATE] * t + m[_Q_RATE_SCALE] * m[_W2]
    for i in range(2, 5):
        p[i, i] += m[_Q_BIAS] * t
    for i in range(5, 8):
        p[i, i] += m[_Q_FORCE] * t + m[_Q_FORCE_SCALE] * m[_A2]


@kernel("void(f8[::1])")
def _correct(m):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Covariance up to now, velocity expected at zero, bias measured where it is still; errors into the state."""
    t = m[_TIME]
    p = m[_P : _P + _N * _N].reshape(_N, _N)
    _predict(m, p)
    dx = np.zeros(_N)
    for i in range(3):
        _measure(p, dx, 5 + i, -m[_V + i], m[_R_VELOCITY] / t)
    if m[_STILL] >= m[_REST_S]:
        for i in range(3):
            _measure(p, dx, 2 + i, m[_WLOW + i] - m[_B + i], m[_R_REST] / t)
        low = length((m[_FLOW], m[_FLOW + 1], m[_FLOW + 2]))
        m[_G] += t / 2.0 * (low - m[_G]) if t < 2.0 else 0.0
    k = m[_K : _K + 4]
    store(k, turn_earth(load(k), (dx[0], dx[1], 0.0)))
    for i in range(3):
        m[_B + i] += dx[2 + i]
        m[_V + i] += dx[5 + i]
    for a in range(_N):  # stays symmetric
        for b in range(a):
            p[a, b] = p[b, a] = 0.5 * (p[a, b] + p[b, a])
    m[_F:_WLOW] = 0.0


@kernel("void(f8[::1], f8, f8[::1], f8[::1])")
def _still(m, dt, rate, force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """How long rate and specific force have stayed near their low-passes."""
    if m[_STARTED] == 0.0:
        m[_STARTED] = 1.0
        m[_WLOW : _WLOW + 3] = rate
        m[_FLOW : _FLOW + 3] = force
    share = min(dt / _REST_TAU, 1.0)
    off_rate = off_force = 0.0
    for i in range(3):
        m[_WLOW + i] += share * (rate[i] - m[_WLOW + i])
        m[_FLOW + i] += share * (force[i] - m[_FLOW + i])
        off_rate += (rate[i] - m[_WLOW + i]) ** 2
        off_force += (force[i] - m[_FLOW + i]) ** 2
    if off_rate < m[_REST_RATE] and off_force < m[_REST_FORCE]:
        m[_STILL] += dt
    else:
        m[_STILL] = 0.0


@kernel("b1(f8[::1], f8, f8, f8)")
def _undisturbed(m, age, norm, dip):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Whether a field fits its reference, which follows slowly; a field that stays elsewhere becomes the reference."""
    if m[_FIELDS] == 0.0:
        m[_NORM], m[_DIP] = norm, dip
    if abs(norm - m[_NORM]) <= m[_STRENGTH] * m[_NORM] and abs(dip - m[_DIP]) <= m[_DIP_LIMIT]:
        share = max(min(age / _FIELD_TAU, 1.0), 1.0 / (m[_FIELDS] + 1.0) if m[_FIELDS] < 100.0 else 0.0)
        m[_NORM] += share * (norm - m[_NORM])
        m[_DIP] += share * (dip - m[_DIP])
        m[_OFF] = 0.0
        return True
    if (
        m[_OFF] == 0.0
        or abs(norm - m[_OFF_NORM]) > m[_STRENGTH] * m[_OFF_NORM]
        or abs(dip - m[_OFF_DIP]) > m[_DIP_LIMIT]
    ):
        m[_OFF_NORM], m[_OFF_DIP], m[_OFF] = norm, dip, 0.0
    m[_OFF] += max(age, 1e-3)
    if m[_OFF] > m[_NEW_S]:
        m[_NORM], m[_DIP], m[_OFF] = m[_OFF_NORM], m[_OFF_DIP], 0.0
    return False


@kernel("void(f8[::1], f8[::1])")
def _heading(m, mag):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """The filter's earth frame turned towards the horizontal field."""
    field = vector(mag)
    norm = length(field)
    if not norm > 0.0:
        return
    ex, ey, ez = to_earth(load(m[_K : _K + 4]), field)
    age = m[_AGE]
    m[_AGE] = 0.0
    if not _undisturbed(m, age, norm, atan2(-ez, sqrt(ex * ex + ey * ey))):
        return
    m[_FIELDS] += 1.0
    off = atan2(ex, ey) - m[_DELTA]
    off -= 2.0 * pi * np.round(off / (2.0 * pi))
    m[_DELTA] += max(1.0 - exp(-age / m[_TAU]), 1.0 / m[_FIELDS]) * off


@kernel("void(f8[::1], f8[::1], f8, f8[::1])")
def _accumulate(m, k, dt, force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Velocity, and what the covariance needs, over one sample."""
    w, x, y, z = k[0], k[1], k[2], k[3]
    m[_R] += dt * (1.0 - 2.0 * (y * y + z * z))
    m[_R + 1] += dt * 2.0 * (x * y - w * z)
    m[_R + 2] += dt * 2.0 * (x * z + w * y)
    m[_R + 3] += dt * 2.0 * (x * y + w * z)
    m[_R + 4] += dt * (1.0 - 2.0 * (x * x + z * z))
    m[_R + 5] += dt * 2.0 * (y * z - w * x)
    ex, ey, ez = to_earth(load(k), vector(force))
    ez_free = ez - m[_G]
    m[_V] += dt * ex
    m[_V + 1] += dt * ey
    m[_V + 2] += dt * ez_free
    m[_F] += dt * ex
    m[_F + 1] += dt * ey
    m[_F + 2] += dt * ez
    m[_A2] += dt * (ex * ex + ey * ey + ez_free * ez_free)
    m[_TIME] += dt


@kernel("void(f8[::1], f8, f8[::1], f8[::1], f8[::1], b1)")
def _step(m, dt, rate, force, mag, has_field):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    k = m[_K : _K + 4]
    wx, wy, wz = rate[0] - m[_B], rate[1] - m[_B + 1], rate[2] - m[_B + 2]
    store(k, turn(load(k), dt, (wx, wy, wz)))
    m[_AGE] += dt
    if length(vector(force)) > 0.0:
        _still(m, dt, rate, force)
        _accumulate(m, k, dt, force)
        m[_W2] += dt * (wx * wx + wy * wy + wz * wz)
        if m[_TIME] >= m[_STEP_S]:
            _correct(m)
    if has_field:
        _heading(m, mag)
    for i in range(4):
        m[i] = k[i]
    if m[_DELTA] != 0.0:
        store(m, turn_earth(load(m), (0.0, 0.0, m[_DELTA])))


@kernel(SIGNATURE_IMU)
def imu(m, dt, rate, force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """One sample without a field."""
    _step(m, dt, rate, force, rate, False)


@kernel(SIGNATURE_FIELD)
def field(m, dt, rate, force, mag):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """One sample with a field."""
    _step(m, dt, rate, force, mag, True)


@kernel(SIGNATURE_BATCH)
def batch(m, dt, rate, force, mag):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Many samples."""
    out = np.empty((dt.shape[0], 4))
    fields = mag.shape[0] > 0
    for i in range(dt.shape[0]):
        _step(m, dt[i], rate[i], force[i], mag[i] if fields else rate[i], fields)
        out[i] = m[:4]
    return out
