"""How hard the carriage is driven, now and remembered: what rectifies or warms by shaking and friction follows it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gsense_fusion.identification.campaign import RunData
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.likelihood.slow import Blocks
from gsense_fusion.identification.types import FloatArray

MEMORIES_S = (20.0, 60.0, 180.0)
"""Time constants of what friction or shaking may warm: an element, a board, a carriage."""
SETTLES_S = 5.0
"""The same of an element that recovers between two runs."""
STEP_S = 1.0


def exertion(likelihood: Likelihood, fit: Fit) -> tuple[FloatArray, tuple[str, ...]]:
    """Mean square of the acceleration as it is, then it and the speed's mean modulus remembered.

    Returns:
        Columns of block means, shape (b, k), and each one in words.

    """
    blocks, runs = likelihood.blocks, likelihood.campaign.fit
    square = np.zeros(len(blocks))
    for i, (number, w) in enumerate(likelihood.cuts):
        kin = likelihood.source.of(runs[number], fit.templates).kinematics
        square[i] = float(np.mean(kin.acceleration[w.start : w.stop] ** 2))
    columns: list[FloatArray] = [square]
    words = ["the mean square of the acceleration (rectification)"]
    driven = _driven(likelihood, fit)
    for i, name in enumerate(("the acceleration's mean square", "the mean speed")):
        for memory in MEMORIES_S:
            columns.append(remembered(blocks, driven, i, memory))
            words.append(f"{name} over some {memory:.0f} s before: it warms up")
    return np.stack(columns, axis=1), tuple(words)


def lingering(likelihood: Likelihood, fit: Fit) -> FloatArray:
    """What shaking may leave in the bias, in motion and at the rest after it: columns of block means, shape (b, k)."""
    own = remembered(likelihood.blocks, _driven(likelihood, fit), 0, SETTLES_S)
    return np.column_stack([exertion(likelihood, fit)[0], own])


def _driven(likelihood: Likelihood, fit: Fit) -> list[tuple[int, FloatArray]]:
    """Session of each run in order of time, held-out ones too, with rows (time in s, a^2, |v|) a second, (m, 3)."""
    return [_rows(likelihood, fit, run) for run in sorted(likelihood.campaign.runs, key=lambda r: float(r.run.time[0]))]


def _rows(likelihood: Likelihood, fit: Fit, data: RunData) -> tuple[int, FloatArray]:
    kin = likelihood.source.of(data, fit.templates).kinematics
    step = max(1, round(STEP_S * data.run.rate_hz))
    starts = np.arange(0, len(data.run.time), step)
    size = np.diff(np.append(starts, len(data.run.time)))
    series = (data.run.time, kin.acceleration**2, np.abs(kin.velocity))
    return data.run.session, np.stack([np.add.reduceat(x, starts) / size for x in series], axis=1)


def remembered(blocks: Blocks, driven: Sequence[tuple[int, FloatArray]], which: int, memory_s: float) -> FloatArray:
    """Mean over each block of a first-order lag of what drives it, at rest between runs.

    Args:
        blocks: Where the means are wanted, b of them.
        driven: Session and rows (time, drivers) of the runs in order of time.
        which: Number of the driver.
        memory_s: Time constant.

    Returns:
        Shape (b,).

    """
    stay = float(np.exp(-STEP_S / memory_s))
    level, last, session = 0.0, -np.inf, -1
    times: list[float] = []
    levels: list[float] = []
    for number, rows in driven:
        level, session = level if number == session else 0.0, number
        for time, value in rows[:, [0, 1 + which]]:
            pause = max(float(time) - last - STEP_S, 0.0)
            level = level * float(np.exp(-pause / memory_s)) * stay + float(value) * (1.0 - stay)
            last = float(time)
            times.append(last)
            levels.append(level)
    half = blocks.duration / 2
    first, after = np.searchsorted(times, blocks.time - half), np.searchsorted(times, blocks.time + half)
    first = np.minimum(first, len(levels) - 1)
    return np.array([np.mean(levels[i : max(j, i + 1)]) for i, j in zip(first, after, strict=True)])
