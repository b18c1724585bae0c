"""The compiled kernel of the compensation: one step, and the loop over it; both give identical numbers.

The arrays behind `CompensatorState` are passed in and changed in place. What a term cannot know (no temperature yet, no
specific force, no carriage) leaves the rate as it is.
"""

from __future__ import annotations

from math import isfinite

import numpy as np

from gsense_fusion.compiling import kernel

from .remembering import STALE_S, current, resonance, temperature
from .terms.numbers import (
    KIND_FORCE,
    KIND_FRICTION,
    KIND_JERK,
    KIND_RESONANCE,
    KIND_SCALE,
    KIND_SPEED,
    KIND_SQUARE,
    KIND_SUPPLY,
    KIND_TEMPERATURE,
)

CAPACITY = 512
"""Samples of specific force that are remembered: 2.5 s at 200 Hz."""
SLOPE_NS = 60_000_000
"""Length of the parabola whose end slope is the jerk: 2 % short at 8 rad/s, a tenth of the noise of a difference."""


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


# One function, long as it is: with memory of forces and the taking-off apart, a sample costs up to 1.7 times as much.
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
        square = 0.0
        if kind == KIND_TEMPERATURE:
            warm = temperature(memory[k], row[13], dt, inputs[0])
            if isfinite(warm):
                for i in range(3):
                    rate[i] -= row[i] * (warm - row[12])
        elif kind == KIND_SUPPLY:
            if isfinite(inputs[1]):
                for i in range(3):
                    rate[i] -= row[i] * (inputs[1] - row[12])
        elif kind in (KIND_FRICTION, KIND_SPEED):
            if isfinite(inputs[2]):
                v = inputs[2] if kind == KIND_SPEED else current(row, memory[k], dt, inputs[2])
                for i in range(3):
                    rate[i] -= row[i] * v
            else:
                memory[k, 3] = 0.0
        elif kind == KIND_SCALE:
            x, y, z = rate[0], rate[1], rate[2]
            for i in range(3):
                rate[i] = row[3 * i] * x + row[3 * i + 1] * y + row[3 * i + 2] * z
        elif not known:
            continue
        elif kind == KIND_RESONANCE:
            swing = resonance(memory[k], row[13], row[14], dt, along)
            for i in range(3):
                rate[i] -= row[i] * swing + row[3 + i] * memory[k, 1]
        else:
            if kind == KIND_JERK:
                if not _slope_at(ring, stamps, forces, stamp - max(delay_ns, 0), row[13], ring[0], scratch):
                    continue
                along = row[9] * g[0] + row[10] * g[1] + row[11] * g[2]
            else:
                for i in range(3):
                    g[i] = f[i] if kind == KIND_FORCE else (f[i] * f[i] if kind == KIND_SQUARE else f[i] * f[i] * f[i])
                square = along * along
                along = square if kind == KIND_SQUARE else square * along
            if row[15] == 1.0:
                for i in range(3):  # of the higher order only squares and cubes have any
                    rate[i] -= (row[i] + row[3 + i] * square) * along
            else:
                _take(row, g, rate)
    inputs[0] = np.nan


_BATCH = _FIRST + "f8[:, ::1], i8[::1], f8[:, ::1], f8[:, ::1])"


@kernel(_BATCH)
def batch(kinds, rows, delay_ns, ring, stamps, forces, memory, scratch, inputs, stamp, force, rate) -> None:  # type: ignore[no-untyped-def] # noqa: ANN001
    """`step` over n samples; `inputs`, `force` and `rate` have shape (n, 3)."""
    for i in range(stamp.shape[0]):
        step(kinds, rows, delay_ns, ring, stamps, forces, memory, scratch, inputs[i], stamp[i], force[i], rate[i])
