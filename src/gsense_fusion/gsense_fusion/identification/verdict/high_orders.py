"""Power at the orders of the drive above the tenth, pooled in bands: each order alone may be too weak to be seen."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import f as fisher

from gsense_fusion.identification.likelihood.bins import HIGHEST_HZ
from gsense_fusion.identification.types import BoolArray, FloatArray
from gsense_fusion.identification.verdict.residual import HALF_ORDERS, WindowResidual

EDGES_HZ = (1.5, 3.0, 5.0, 8.0, 12.0, 18.0, HIGHEST_HZ)
"""Up to where models are fitted."""
REACH = 1.0
"""Bins to either side that a steady order reaches."""
UNEVEN = 0.01
"""Relative error of the power at the orders against that between them, in the same windows."""
LEAST = 30


@dataclass(frozen=True)
class LockedBand:
    """A band whose orders stand out."""

    p_value: float
    """With the number of looks."""
    axis: int
    low_hz: float
    high_hz: float
    rate_rms: float
    """rad/s, over the windows in motion."""


def locked_band(moving: Sequence[WindowResidual]) -> LockedBand | None:
    """The band and axis in which the high orders stand out most; None where no window has any.

    What lies between the orders, in the same windows, says how high the noise is.
    """
    at = [_at_orders(w) for w in moving]
    found: list[LockedBand] = []
    for low, high in itertools.pairwise(EDGES_HZ):
        inside = [(w.frequency >= low) & (w.frequency < high) for w in moving]
        between = [i & w.away_from_orders() & (a.any()) for i, w, a in zip(inside, moving, at, strict=True)]
        locked = [i & a for i, a in zip(inside, at, strict=True)]
        n, m = sum(int(x.sum()) for x in locked), sum(int(x.sum()) for x in between)
        if n < LEAST or m < LEAST:
            continue
        known = 1.0 / (1.0 / m + UNEVEN**2)
        for axis in range(3):
            level = max(1.0, float(_power(moving, between, axis).mean()))
            power = _power(moving, locked, axis)
            p = float(fisher.sf(power.mean() / level, 2 * n, 2 * known))
            rms = np.sqrt(max(_square(moving, locked, axis, level), 0.0))
            found.append(LockedBand(p, axis, low, high, float(rms)))
    if not found:
        return None
    best = min(found, key=lambda f: f.p_value)
    return LockedBand(min(1.0, len(found) * best.p_value), best.axis, best.low_hz, best.high_hz, best.rate_rms)


def _at_orders(window: WindowResidual) -> BoolArray:
    """Bins at whole orders above the tenth, where orders are apart, shape (m,)."""
    w = window.angular_frequency
    if w is None:
        return np.zeros(len(window.frequency), dtype=bool)
    order = window.frequency * 2 * np.pi / w
    bin_orders = window.resolution_hz * 2 * np.pi / w
    near = np.abs(order - np.rint(order)) < REACH * bin_orders
    return np.asarray(near & (order > HALF_ORDERS[-1] + 0.5) & ~window.away_from_orders())


def _power(moving: Sequence[WindowResidual], bins: Sequence[BoolArray], axis: int) -> FloatArray:
    return np.concatenate([w.power[b, axis] for w, b in zip(moving, bins, strict=True)])


def _square(moving: Sequence[WindowResidual], bins: Sequence[BoolArray], axis: int, level: float) -> float:
    """Mean square over the windows of what stands out, (rad/s)^2: the whitening inverted."""
    out = 0.0
    for w, b in zip(moving, bins, strict=True):
        weight = np.maximum(w.bins.weight[b, axis], 1e-30)
        out += float(np.sum((w.power[b, axis] - level) * 4.0 / (len(w.window) * weight) ** 2))
    return out / max(len(moving), 1)
