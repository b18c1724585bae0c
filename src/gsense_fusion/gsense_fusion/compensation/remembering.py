"""Terms that remember, compiled: a lagging temperature, a resonance, the carriage's acceleration.

`m` is what a term remembers, MEMORY numbers, changed in place.
"""

from __future__ import annotations

from math import cos, exp, isfinite, pi, sin, sqrt

import numpy as np

from gsense_fusion.compiling import kernel

STALE_S = 0.5
"""After a longer gap a resonance has settled, and forces from before are forgotten."""
THERMOMETER_VARIANCE = 0.1**2
"""K^2, of one reading of a die thermometer."""
SLOPE_WALK = 3e-3**2
"""(K/s)^2/s: how quickly the slope of the die temperature changes."""
SLOPE_VARIANCE = 0.05**2
"""(K/s)^2 of the slope before the first reading."""
SPEED_MEMORY_S = 0.012
"""Of the parabola through the carriage's past speeds whose end slope is its acceleration: 1 % off at 8 rad/s."""
MEMORY = 16
"""Numbers that a term remembers: resonance 0 y, 1 y', 2 d.f, 3 set; temperature 0..2 state, 3..8 covariance, 9 set;
friction 0 v, 1 v', 2 v'', 3 set."""


@kernel("void(f8[::1], f8, f8)")
def _warm_on(m, lag, dt):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """State and covariance of the temperature ahead by dt."""
    # F = [[1, dt, 0], [0, 1, 0], [a, b, e]]: exact for a constant slope
    e = exp(-dt / lag) if lag > 0.0 else 0.0
    a = 1.0 - e
    b = dt - lag * a
    t, s, u = m[0], m[1], m[2]
    m[0], m[1], m[2] = t + s * dt, s, a * t + b * s + e * u
    p00, p01, p02, p11, p12, p22 = m[3], m[4], m[5], m[6], m[7], m[8]
    q0, q1, q2 = SLOPE_WALK * dt * dt * dt / 3.0, SLOPE_WALK * dt * dt / 2.0, SLOPE_WALK * dt
    m[3] = p00 + 2.0 * dt * p01 + dt * dt * p11 + q0
    m[4] = p01 + dt * p11 + q1
    m[6] = p11 + q2
    if lag == 0.0:
        m[5], m[7], m[8] = m[3], m[4], m[3]
        return
    m[5] = a * (p00 + dt * p01) + b * (p01 + dt * p11) + e * (p02 + dt * p12)
    m[7] = a * p01 + b * p11 + e * p12
    m[8] = a * a * p00 + b * b * p11 + e * e * p22 + 2.0 * (a * b * p01 + a * e * p02 + b * e * p12)


@kernel("void(f8[::1], f8)")
def _correct(m, reading):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """The temperature's state and covariance after a reading."""
    p00, p01, p02 = m[3], m[4], m[5]
    total = p00 + THERMOMETER_VARIANCE
    k0, k1, k2 = p00 / total, p01 / total, p02 / total
    wrong = reading - m[0]
    m[0] += k0 * wrong
    m[1] += k1 * wrong
    m[2] += k2 * wrong
    m[8] -= k2 * p02
    m[7] -= k1 * p02
    m[6] -= k1 * p01
    m[5] -= k0 * p02
    m[4] -= k0 * p01
    m[3] -= k0 * p00


@kernel("f8(f8[::1], f8, f8, f8)")
def temperature(m, lag, dt, reading):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Temperature that the sensing element has, degrees Celsius; NaN before the first reading.

    Kalman filter of (T, slope, T'), T' behind a first-order lag. Before the first reading the die was on a ramp of
    unknown slope, T' = T - slope lag; what the readings tell of the slope corrects T' too. A lag that starts settled at
    the first reading instead is wrong by slope lag, and a bias taken then stays wrong.
    """
    if m[9] == 0.0:
        if not isfinite(reading):
            return np.nan
        r, s = THERMOMETER_VARIANCE, SLOPE_VARIANCE
        m[0], m[1], m[2] = reading, 0.0, reading
        m[3], m[4], m[5], m[6], m[7], m[8] = r, 0.0, r, s, -lag * s, r + lag * lag * s
        m[9] = 1.0
        return m[2]
    _warm_on(m, lag, dt)
    if isfinite(reading):
        _correct(m, reading)
    return m[2]


@kernel("f8(f8[::1], f8, f8, f8, f8)")
def resonance(m, f0, damping, dt, force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Output of y'' + 2 z w y' + w^2 y = w^2 u, exact for a force that is linear between samples."""
    if m[3] == 0.0 or dt > STALE_S:
        m[0], m[1], m[2], m[3] = force, 0.0, force, 1.0
        return force
    if dt > 0.0:
        w = 2.0 * pi * f0
        a, d = damping * w, w * sqrt(1.0 - damping * damping)
        ramp = (force - m[2]) / dt
        lagging = 2.0 * damping * ramp / w
        z, v = m[0] - (m[2] - lagging), m[1] - ramp
        c, s, e = cos(d * dt), sin(d * dt) / d, exp(-a * dt)
        m[0] = e * (z * c + (v + a * z) * s) + force - lagging
        m[1] = e * (v * c - (w * w * z + a * v) * s) + ramp
    m[2] = force
    return m[0]


@kernel("f8(f8[::1], f8, f8)")
def _acceleration(m, dt, velocity):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Of the carriage, m/s^2: end slope of a parabola through its past speeds, older ones counting for less.

    N. Morrison, Introduction to Sequential Smoothing and Prediction (1969), chapter 13: fading memory, degree 2.
    """
    if m[3] == 0.0 or dt > STALE_S:
        m[0], m[1], m[2], m[3] = velocity, 0.0, 0.0, 1.0
        return 0.0
    if dt > 0.0:
        t = exp(-dt / SPEED_MEMORY_S)
        wrong = velocity - (m[0] + dt * (m[1] + dt * m[2] / 2.0))
        m[0] = velocity - t * t * t * wrong
        m[1] += dt * m[2] + 1.5 * (1.0 - t) ** 2 * (1.0 + t) * wrong / dt
        m[2] += (1.0 - t) ** 3 * wrong / (dt * dt)
    return m[1]


@kernel("f8(f8[::1], f8[::1], f8, f8)")
def current(row, m, dt, velocity):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """What a motor's current follows: the direction, and with an inertia the acceleration; 1."""
    sign = 1.0 if velocity > 0.0 else (-1.0 if velocity < 0.0 else 0.0)
    return sign if row[13] == 0.0 else sign + row[13] * _acceleration(m, dt, velocity)
