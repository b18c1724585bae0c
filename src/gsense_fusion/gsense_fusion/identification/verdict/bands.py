"""Broadband power in motion against rest."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import f as fisher
from scipy.stats import norm

from gsense_fusion.identification.types import FloatArray
from gsense_fusion.identification.verdict.growing_noise import MODEL_ERROR
from gsense_fusion.identification.verdict.residual import WindowResidual
from gsense_fusion.identification.verdict.uneven_noise import LEAST_LEVEL

EDGES_HZ = (0.1, 0.4, 1.6, 6.4, 12.8, 25.0, 50.0, 100.0, 200.0)
LEAST = 30
"""Ordinates in motion, and at rest."""


@dataclass(frozen=True)
class LouderBand:
    """The band and axis in which motion exceeds rest most significantly."""

    z: float
    """Of the one band."""
    looks: int
    axis: int
    low_hz: float
    high_hz: float
    rate_rms: float
    """What is too much there, rad/s."""


@dataclass(frozen=True, eq=False)
class _Band:
    """Ordinates of windows in a band, away from the drive's orders."""

    mean: float
    """Of their power over its expectation."""
    unfolded: float
    """The same without what may be folded at most."""
    frequency: FloatArray
    """Of each, Hz."""
    variance: float
    """What the band is expected to hold, (rad/s)^2."""
    window_means: FloatArray
    """Mean power of each window that reaches the band, shape (k,)."""
    counts: FloatArray
    """Ordinates of each, shape (k,)."""

    @property
    def one_window(self) -> float:
        """Part of the variance of one window that the mean over all has."""
        return float(np.sum((self.counts / self.counts.sum()) ** 2))


def louder_band(moving: Sequence[WindowResidual], still: Sequence[WindowResidual]) -> LouderBand | None:
    """The band and axis in which motion exceeds rest most; None where no band has ordinates enough of both."""
    worst: LouderBand | None = None
    looks = 0
    for low, high in itertools.pairwise(EDGES_HZ):
        for axis in range(3):
            motion, rest = _band(moving, low, high, axis), _band(still, low, high, axis)
            if min(len(motion.frequency), len(rest.frequency)) < LEAST or rest.mean <= 0.0:  # a coarse step
                continue
            looks += 1
            folded = max((motion.mean - motion.unfolded) - (rest.mean - rest.unfolded), 0.0)
            # means of exponential ordinates: their ratio is F, and the spectrum's own error makes the rest shorter
            spectrum = moving[0].bins.noise[axis].variance_between(motion.frequency, rest.frequency)
            wander = unsteady(rest.window_means, rest.counts) * (rest.one_window + motion.one_window)
            known = 1.0 / (1.0 / len(rest.frequency) + MODEL_ERROR**2 + spectrum + wander)
            level = max(rest.mean, LEAST_LEVEL) + folded
            p = fisher.sf(motion.mean / level, 2 * len(motion.frequency), 2 * known)
            z = float(norm.isf(np.clip(p, 1e-300, 1.0)))
            if worst is None or z > worst.z:
                excess = (motion.mean - level) * motion.variance
                worst = LouderBand(z, 0, axis, low, high, float(np.sqrt(max(excess, 0.0))))
    return None if worst is None else replace(worst, looks=looks)


def unsteady(means: FloatArray, counts: FloatArray) -> float:
    """Relative variance of a level from window to window beyond that of so many exponential ordinates.

    By moments (DerSimonian and Laird, 1986): at low frequencies a real gyro's noise wanders, and a few minutes of rest
    know its level no better than it wanders from one of them to the next.

    Args:
        means: Mean power of each window, shape (k,).
        counts: Ordinates of each, shape (k,).

    """
    total = float(counts.sum())
    room = total - float(np.sum(counts**2)) / total
    if len(means) < 2 or room <= 0.0:
        return 0.0
    common = float(counts @ means) / total
    spread = float(counts @ (means / common - 1.0) ** 2)
    return max(spread - (len(means) - 1), 0.0) / room


def _band(windows: Sequence[WindowResidual], low: float, high: float, axis: int) -> _Band:
    parts: list[FloatArray] = []
    variance = 0.0
    for w in windows:
        inside = (w.frequency >= low) & (w.frequency < high) & w.away_from_orders() & (w.bins.weight[:, axis] > 0)
        if not inside.any():
            continue
        parts.append(np.stack([w.frequency, w.power[:, axis], w.unfolded[:, axis]])[:, inside])
        n = len(w.window)
        variance = max(variance, float(np.sum(4.0 / (n**2 * np.maximum(w.bins.weight[inside, axis], 1e-30) ** 2))))
    frequency, *powers = np.concatenate([np.zeros((3, 0)), *parts], axis=1)
    mean, unfolded = (float(p.mean()) if len(frequency) else 1.0 for p in powers)
    means, counts = np.array([[p[1].mean(), p.shape[1]] for p in parts]).reshape(-1, 2).T
    return _Band(mean, unfolded, frequency, variance, means, counts)
