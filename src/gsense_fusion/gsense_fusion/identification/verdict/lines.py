"""Lines at a fixed frequency in the residual, in single windows and pooled over all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, ncx2
from scipy.stats import f as fisher

from gsense_fusion.identification.types import FloatArray, IntArray
from gsense_fusion.identification.verdict.residual import WindowResidual

LINE_REACH = 3
"""Bins to either side that a line may reach; the level of the noise comes from those up to `LEVEL_REACH`."""
LEVEL_REACH = 25
HUMP_REACH = 5
"""Bins to either side over which rest tells the level: noise may have a hump that is narrower than its smoothing."""
REST_ALPHA = 0.01
REACHED = 0.8
"""Part of a line's power that the bins around it hold."""


@dataclass(frozen=True)
class Line:
    """A line at a fixed frequency."""

    p_value: float
    frequency_hz: float
    axis: int
    amplitude: float
    """rad/s."""


def _amplitude(residual: WindowResidual, bin_: int, axis: int, power: float) -> float:
    """Of a sine that puts this power into a bin, rad/s: the whitening inverted."""
    return float(np.sqrt(2 * power) / (residual.bins.weight[bin_, axis] * len(residual.window) / 2))


def single_lines(moving: Sequence[WindowResidual], alpha: float, still: Sequence[WindowResidual] = ()) -> list[Line]:
    """Bins of one window that stand out of those beside them, and of what rest has there."""
    looks = sum(int(w.away_from_orders().sum()) * 3 for w in moving)
    threshold = np.log(looks / alpha)
    out = []
    for w in moving:
        away = w.away_from_orders()
        level, near = _beside(w.power * away[:, None], away.astype(float))
        level, known = _no_hump(w, still, level, _known(near, w.bins.variance))
        # exponential ordinates over a level from m others: the tail (1 + x/m)^-m, put back on the scale of exp(-x)
        calibrated = known * np.log1p(w.power / level / known)
        for i, axis in zip(*np.nonzero((calibrated > threshold) & away[:, None]), strict=True):
            p = float(min(1.0, looks * np.exp(-calibrated[i, axis])))
            amplitude = _amplitude(w, int(i), int(axis), float(w.power[i, axis]))
            out.append(Line(p, float(w.frequency[i]), int(axis), amplitude))
    return out


def pooled_lines(moving: Sequence[WindowResidual], alpha: float, still: Sequence[WindowResidual] = ()) -> list[Line]:
    """Sum of the nearest bins of all windows on the coarsest window's grid."""
    coarse = max(moving, key=lambda w: w.resolution_hz)
    total = np.zeros((len(coarse.frequency), 3))
    count = np.zeros(len(coarse.frequency))
    nearest: list[tuple[WindowResidual, IntArray]] = []
    for w in moving:
        at = np.clip(np.rint((coarse.frequency - w.frequency[0]) / w.resolution_hz), 0, len(w.frequency) - 1).astype(
            int
        )
        usable = w.away_from_orders()[at]
        total += w.power[at] * usable[:, None]
        count += usable
        nearest.append((w, at))
    level, near = _beside(total, count)
    level, known = _no_hump(coarse, still, level, _known(near, coarse.bins.variance))
    mean = total / np.maximum(count, 1)[:, None]
    p = np.asarray(fisher.sf(mean / level, 2 * np.maximum(count, 1)[:, None], 2 * known))
    looks = int((count > 1).sum()) * 3
    out = []
    for i, axis in zip(*np.nonzero((p < alpha / max(1, looks)) & (count > 1)[:, None]), strict=True):
        excess = float(total[i, axis] / count[i] - 1.0)
        w, at = nearest[0]
        amplitude = _amplitude(w, int(at[i]), int(axis), max(excess, 0.0))
        out.append(Line(float(min(1.0, looks * p[i, axis])), float(coarse.frequency[i]), int(axis), amplitude))
    return out


def equal_at_rest(line: Line, moving: Sequence[WindowResidual], still: Sequence[WindowResidual]) -> bool:
    """Whether rest shows the line too, and no weaker than motion: too weak there for a notch, seen by many windows."""
    reach = min(w.resolution_hz for w in moving)
    motion, rest = (_pooled(line, windows, reach) for windows in (moving, still))
    if not rest.count or not motion.count:
        return False
    expected = max(motion.power - motion.count, 0.0) / motion.per_square * rest.per_square
    there = chi2.sf(2 * rest.power, 2 * rest.count) < REST_ALPHA
    return bool(there and ncx2.cdf(2 * rest.power, 2 * rest.count, 2 * REACHED * expected) > REST_ALPHA)


@dataclass(frozen=True)
class _Pooled:
    """The bins around a line in several windows."""

    power: float
    """Sum over their expectation from noise."""
    count: int
    per_square: float
    """What a squared amplitude in (rad/s)^2 adds to the power."""


def _pooled(line: Line, windows: Sequence[WindowResidual], reach_hz: float) -> _Pooled:
    power, count, per_square = 0.0, 0, 0.0
    for w in windows:
        weight = w.bins.weight[:, line.axis]
        distance = np.abs(w.frequency - line.frequency_hz)
        near = (distance < max(reach_hz, w.resolution_hz)) & (weight > 0) & w.away_from_orders()
        if near.any():
            power += float(w.power[near, line.axis].sum())
            count += int(near.sum())
            per_square += float(np.mean((weight[near] * len(w.window) / 2) ** 2)) / 2
    return _Pooled(power, count, per_square)


def _beside(total: FloatArray, count: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Level of the noise beside each bin, never under one, and from how many ordinates it is known.

    The spectrum from some minutes of rest is off by a fifth here and there; many windows together would make it a line.

    Args:
        total: Sum of the windows' powers in each bin, shape (m, 3).
        count: Number of windows that reach it, shape (m,).

    """
    m = len(count)
    both = np.concatenate([np.zeros((1, 4)), np.cumsum(np.column_stack([total, count]), axis=0)])

    def around(bins: int) -> FloatArray:
        at = np.arange(m)
        return np.asarray(both[np.minimum(at + bins + 1, m)] - both[np.maximum(at - bins, 0)])

    near = around(LEVEL_REACH) - around(LINE_REACH)
    known = np.maximum(near[:, 3], 1.0)
    return np.maximum(near[:, :3] / known[:, None], 1.0), known


def _no_hump(
    window: WindowResidual, still: Sequence[WindowResidual], level: FloatArray, known: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Level of the noise and what it is known by (m, 3), of rest where a hump there is more than what lies beside."""
    reach = HUMP_REACH * window.resolution_hz
    total, count = np.zeros_like(level), np.zeros_like(level)
    for w in still:
        both = np.concatenate([np.zeros((1, 6)), np.cumsum(np.hstack([w.power, w.bins.weight > 0]), axis=0)])
        low, high = (np.searchsorted(w.frequency, window.frequency + side * reach) for side in (-1, 1))
        inside = both[high] - both[low]
        total, count = total + inside[:, :3], count + inside[:, 3:]
    there = (total > level * count) & (chi2.sf(2 * total, 2 * count) < REST_ALPHA)
    return np.where(there, total / np.maximum(count, 1), level), np.where(there, np.minimum(known, count), known)


def _known(near: FloatArray, variance: FloatArray) -> FloatArray:
    """Ordinates that the level of each bin is worth: those beside it, and the spectrum's error between them and it.

    Args:
        near: Ordinates beside each bin, shape (m,).
        variance: Relative variance of the spectrum there, which all windows share, shape (m, 3).

    """
    return np.asarray(1.0 / (1.0 / near[:, None] + variance))
