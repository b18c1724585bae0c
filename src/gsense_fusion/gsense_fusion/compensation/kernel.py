"""The compiled kernel of the compensation: one step, and the loop over it; both give identical numbers.

The arrays behind `CompensatorState` are passed in and changed in place. What a term cannot know (no temperature yet, no
specific force, no carriage) leaves the rate as it is.
"""

from __future__ import annotations

from math import cos, exp, isfinite, pi, sin, sqrt

import numpy as np

from gsense_fusion.compiling import kernel

CAPACITY = 512
"""Samples of specific force that are remembered: 2.5 s at 200 Hz."""
SLOPE_NS = 60_000_000
"""Length of the parabola whose end slope is the jerk: 2 % short at 8 rad/s, a tenth of the noise of a difference."""
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


@kernel("f8(f8[::1], f8, f8, f8)")
def _temperature(m, lag, dt, reading):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
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
    # F = [[1, dt, 0], [0, 1, 0], [a, b, e]]: exact for a constant slope
    e = exp(-dt / lag) if lag > 0.0 else 0.0
    a = 1.0 - e
    b = dt - lag * a
    t, s, u = m[0], m[1], m[2]
    m[0], m[1], m[2] = t + s * dt, s, a * t + b * s + e * u
    p00, p01, p02, p11, p12, p22 = m[3], m[4], m[5], m[6], m[7], m[8]
    q0, q1, q2 = SLOPE_WALK * dt * dt * dt / 3.0, SLOPE_WALK * dt * dt / 2.0, SLOPE_WALK * dt
    n02 = a * (p00 + dt * p01) + b * (p01 + dt * p11) + e * (p02 + dt * p12)
    n12 = a * p01 + b * p11 + e * p12
    n22 = a * a * p00 + b * b * p11 + e * e * p22 + 2.0 * (a * b * p01 + a * e * p02 + b * e * p12)
    n00 = p00 + 2.0 * dt * p01 + dt * dt * p11 + q0
    n01 = p01 + dt * p11 + q1
    n11 = p11 + q2
    if lag == 0.0:
        n02, n12, n22 = n00, n01, n00
    if isfinite(reading):
        total = n00 + THERMOMETER_VARIANCE
        k0, k1, k2 = n00 / total, n01 / total, n02 / total
        wrong = reading - m[0]
        m[0] += k0 * wrong
        m[1] += k1 * wrong
        m[2] += k2 * wrong
        n22 -= k2 * n02
        n12 -= k1 * n02
        n11 -= k1 * n01
        n02 -= k0 * n02
        n01 -= k0 * n01
        n00 -= k0 * n00
    m[3], m[4], m[5], m[6], m[7], m[8] = n00, n01, n02, n11, n12, n22
    return m[2]


@kernel("f8(f8[::1], f8, f8, f8, f8)")
def _resonance(m, f0, damping, dt, force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
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
def _current(row, m, dt, velocity):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """What a motor's current follows: the direction, and with an inertia the acceleration; 1."""
    sign = 1.0 if velocity > 0.0 else (-1.0 if velocity < 0.0 else 0.0)
    return sign if row[13] == 0.0 else sign + row[13] * _acceleration(m, dt, velocity)


@kernel("void(i8[::1], i8[::1], f8[:, ::1], i8, i8, f8[::1])")
def _force_at(ring, stamps, forces, wanted, newest, out):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Specific force at a time of the past, linear between samples; the oldest where none is so old."""
    count = ring[1]
    later = newest
    for back in range(1, count):
        if stamps[later] <= wanted:
            break
        earlier = (newest - back) % CAPACITY
        if stamps[earlier] <= wanted:
            part = (wanted - stamps[earlier]) / (stamps[later] - stamps[earlier])
            for i in range(3):
                out[i] = forces[earlier, i] + part * (forces[later, i] - forces[earlier, i])
            return
        later = earlier
    for i in range(3):
        out[i] = forces[later, i]


@kernel("b1(i8[::1], i8[::1], f8[:, ::1], i8, f8, i8, f8[:, ::1])")
def _slope_at(ring, stamps, forces, wanted, lag, newest, scratch):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Slope of the force, to scratch[1]; False with fewer than four samples.

    Of the least-squares parabola that ends at `wanted`, a lag in s before its end.
    """
    s1, s2, s3, s4 = 0.0, 0.0, 0.0, 0.0
    out, y0, y1, y2 = scratch[1], scratch[2], scratch[3], scratch[4]
    for i in range(3):
        y0[i], y1[i], y2[i] = 0.0, 0.0, 0.0
    n = 0
    for back in range(ring[1]):
        at = (newest - back) % CAPACITY
        if stamps[at] > wanted:
            continue
        if stamps[at] <= wanted - SLOPE_NS:
            break
        t = (stamps[at] - wanted) * 1e-9 + lag
        n += 1
        s1, s2, s3, s4 = s1 + t, s2 + t * t, s3 + t * t * t, s4 + t * t * t * t
        for i in range(3):
            y0[i] += forces[at, i]
            y1[i] += t * forces[at, i]
            y2[i] += t * t * forces[at, i]
    if n < 4:
        return False
    # Cramer's rule for the linear coefficient of y = a + b t + c t^2
    det = n * (s2 * s4 - s3 * s3) - s1 * (s1 * s4 - s2 * s3) + s2 * (s1 * s3 - s2 * s2)
    if not det > 0.0:
        return False
    for i in range(3):
        top = n * (y1[i] * s4 - y2[i] * s3) - s1 * (y0[i] * s4 - y2[i] * s2) + s2 * (y0[i] * s3 - y1[i] * s2)
        out[i] = top / det
    return True


@kernel("void(f8[::1], f8[::1], f8[::1])")
def _take(row, regressor, rate):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    for i in range(3):
        taken = row[3 * i] * regressor[0] + row[3 * i + 1] * regressor[1] + row[3 * i + 2] * regressor[2]
        rate[i] -= taken


_FIRST = "void(i8[::1], f8[:, ::1], i8, i8[::1], i8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], "
_STEP = _FIRST + "f8[::1], i8, f8[::1], f8[::1])"


@kernel(_STEP, allocates=False)
def step(kinds, rows, delay_ns, ring, stamps, forces, memory, scratch, inputs, stamp, force, rate) -> None:  # type: ignore[no-untyped-def] # noqa: ANN001, C901, PLR0912, PLR0915
    """Take all terms off one sample.

    Args:
        kinds: what each term is, shape (k,).
        rows: its numbers, shape (k, ROW).
        delay_ns: how much later the gyro is than the accelerometer.
        ring: place of the newest force, number of forces, newest stamp, whether any; shape (4,).
        stamps: of the forces, shape (CAPACITY,).
        forces: m/s^2, shape (CAPACITY, 3).
        memory: of the terms, shape (k, MEMORY).
        scratch: room for the step, shape (5, 3).
        inputs: new temperature reading (used up), supply voltage, carriage velocity; NaN where unknown; shape (3,).
        stamp: of the sample, ns.
        force: m/s^2, NaN where not reported, shape (3,).
        rate: rad/s, shape (3,): in as measured, out as compensated.
    """
    dt = (stamp - ring[2]) * 1e-9 if ring[3] else 0.0
    ring[2], ring[3] = stamp, 1
    known = isfinite(force[0]) and isfinite(force[1]) and isfinite(force[2])
    if dt > STALE_S or dt < 0.0:
        ring[1] = 0
    dt = max(dt, 0.0)  # a clock that was set back: no time has passed that is known
    if known:
        ring[0] = (ring[0] + 1) % CAPACITY
        ring[1] = min(ring[1] + 1, CAPACITY)
        stamps[ring[0]] = stamp
        for i in range(3):
            forces[ring[0], i] = force[i]
    f, g = scratch[0], scratch[1]
    if known:
        if delay_ns > 0:
            _force_at(ring, stamps, forces, stamp - delay_ns, ring[0], f)
        else:
            f[0], f[1], f[2] = force[0], force[1], force[2]
    for k in range(kinds.shape[0]):
        kind, row = kinds[k], rows[k]
        along = row[9] * f[0] + row[10] * f[1] + row[11] * f[2] if row[15] == 1.0 else 0.0
        if kind == 5:
            warm = _temperature(memory[k], row[13], dt, inputs[0])
            if isfinite(warm):
                for i in range(3):
                    rate[i] -= row[i] * (warm - row[12])
        elif kind == 6:
            if isfinite(inputs[1]):
                for i in range(3):
                    rate[i] -= row[i] * (inputs[1] - row[12])
        elif 7 <= kind <= 8:
            if isfinite(inputs[2]):
                v = inputs[2] if kind == 8 else _current(row, memory[k], dt, inputs[2])
                for i in range(3):
                    rate[i] -= row[i] * v
            else:
                memory[k, 3] = 0.0
        elif kind == 9:
            x, y, z = rate[0], rate[1], rate[2]
            for i in range(3):
                rate[i] = row[3 * i] * x + row[3 * i + 1] * y + row[3 * i + 2] * z
        elif not known:
            continue
        elif kind == 4:
            swing = _resonance(memory[k], row[13], row[14], dt, along)
            for i in range(3):
                rate[i] -= row[i] * swing + row[3 + i] * memory[k, 1]
        else:
            if kind == 3:
                if not _slope_at(ring, stamps, forces, stamp - max(delay_ns, 0), row[13], ring[0], scratch):
                    continue
                along = row[9] * g[0] + row[10] * g[1] + row[11] * g[2]
            else:
                for i in range(3):
                    g[i] = f[i] if kind == 0 else (f[i] * f[i] if kind == 1 else f[i] * f[i] * f[i])
                along = along * along if kind == 1 else along * along * along
            if row[15] == 1.0:
                for i in range(3):
                    rate[i] -= row[i] * along
            else:
                _take(row, g, rate)
    inputs[0] = np.nan


_BATCH = _FIRST + "f8[:, ::1], i8[::1], f8[:, ::1], f8[:, ::1])"


@kernel(_BATCH)
def batch(kinds, rows, delay_ns, ring, stamps, forces, memory, scratch, inputs, stamp, force, rate) -> None:  # type: ignore[no-untyped-def] # noqa: ANN001
    """`step` over n samples; `inputs`, `force` and `rate` have shape (n, 3)."""
    for i in range(stamp.shape[0]):
        step(kinds, rows, delay_ns, ring, stamps, forces, memory, scratch, inputs[i], stamp[i], force[i], rate[i])
