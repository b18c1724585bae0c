"""What drift alone would gain by chance: the price of looking at many slow alternatives at once.

A step may be anywhere, a temperature may lag, a supply may sag: the best of many columns is likelier than none in every
session, and more so because drift is estimated anew beside it. How likely is told by sessions of drift alone, with the
strengths that this session's own drift may have, put through the same comparison.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from gsense_fusion.identification.likelihood.slow import GridPoint, SlowNoise
from gsense_fusion.identification.types import FloatArray

DRAWS = 1000
TAIL = 0.05
"""Part of the drawn gains whose excess tells how the tail falls."""
SEED = 20


@dataclass(frozen=True, eq=False)
class Chance:
    """What each alternative gains beside drift, and how often drift alone lets the best one gain as much."""

    gains: FloatArray
    """Twice the log-likelihood, all axes together, shape (k,)."""
    draw: Callable[[], FloatArray]
    """Makes sessions of drift alone and says what the best alternative gains in each; called where it is asked for."""

    @cached_property
    def drawn(self) -> FloatArray:
        """Gain of the best alternative in each drawn session, sorted, shape (DRAWS,)."""
        return np.sort(self.draw())

    def hopeless(self, gain: float, degrees: int, level: float) -> bool:
        """Whether even at known drift the best of all would gain this much more often than `level` by chance."""
        return bool(len(self.gains) * chi2.sf(gain, degrees) > level)

    def p_value(self, gain: float) -> float:
        """Chance that the best alternative gains this much from drift alone; beyond the draws by their tail."""
        start, scale = self._tail()
        if gain <= start:
            return float((1 + np.sum(self.drawn >= gain)) / (len(self.drawn) + 1))
        return float(TAIL * np.exp(-(gain - start) / scale))

    def gain_for(self, p_value: float) -> float:
        """The gain that drift alone reaches with this chance."""
        start, scale = self._tail()
        if p_value >= TAIL:
            return float(np.quantile(self.drawn, 1 - p_value))
        return float(start + scale * np.log(TAIL / p_value))

    def _tail(self) -> tuple[float, float]:
        """Where the tail of the drawn gains begins, and its mean excess."""
        high = self.drawn[round((1 - TAIL) * len(self.drawn)) :]
        return float(high[0]), max(float(np.mean(high - high[0])), 1e-9)


def gains(slow: Mapping[int, SlowNoise], residual: FloatArray, columns: FloatArray, known: FloatArray) -> FloatArray:
    """What each alternative gains in twice the log-likelihood, the drift's strengths being free in both.

    Args:
        slow: Covariances by axis.
        residual: Block means without the model's prediction, rad/s, shape (b, 3).
        columns: One column on every axis for each alternative, shape (b, k).
        known: Columns of the model's own slow effects, profiled out, shape (b, j).

    Returns:
        Shape (k,).

    """
    batch = {axis: residual[:, axis, None] for axis in slow}
    return _gains(slow, batch, columns, known)[:, 0]


def chance(slow: Mapping[int, SlowNoise], residual: FloatArray, columns: FloatArray, known: FloatArray) -> Chance:
    """The same with what drift alone would gain; arguments as `gains`."""
    return Chance(
        gains(slow, residual, columns, known),
        lambda: np.max(_gains(slow, sessions_of_drift(slow, residual, known), columns, known), axis=0),
    )


def _gains(
    slow: Mapping[int, SlowNoise], batch: Mapping[int, FloatArray], columns: FloatArray, known: FloatArray
) -> FloatArray:
    """Gains of sessions (b, n) by axis, shape (k, n); all axes share their strengths in units of white noise."""
    n = next(iter(batch.values())).shape[1]
    without = np.full(n, -np.inf)
    best = np.full((columns.shape[1], n), -np.inf)
    each = [zip(s.grid, profiled(s.grid, known), strict=True) for s in slow.values()]
    for points in zip(*each, strict=True):
        alone, beside = np.zeros(n), np.zeros((columns.shape[1], n))
        for axis, (point, projector) in zip(slow, points, strict=True):
            image = projector @ batch[axis]
            alone -= np.sum(batch[axis] * image, axis=0) + point.logdet
            size = np.sum(columns * (projector @ columns), axis=0)
            gain = (columns / np.sqrt(np.maximum(size, 1e-12 * max(float(size.max()), 1e-300)))).T @ image
            beside += np.square(gain, out=gain)
        without = np.maximum(without, alone)
        np.maximum(best, np.add(beside, alone, out=beside), out=best)
    return best - without


def profiled(points: Sequence[GridPoint], known: FloatArray) -> Iterator[FloatArray]:
    """The projector of each point (b, b), which takes columns (b, j) out too."""
    if not known.shape[1]:
        yield from (p.projector for p in points)
        return
    px = np.array([p.projector @ known for p in points])
    for point, own, inverse in zip(points, px, np.linalg.pinv(known.T @ px), strict=True):
        yield point.projector - own @ inverse @ own.T


def sessions_of_drift(slow: Mapping[int, SlowNoise], residual: FloatArray, known: FloatArray) -> dict[int, FloatArray]:
    """Sessions of drift alone with strengths that this one's blocks (b, 3) may have, (b, DRAWS) by axis."""
    rng = np.random.default_rng(SEED)
    return {axis: _draw(s, residual[:, axis], known, rng) for axis, s in slow.items()}


def _draw(slow: SlowNoise, residual: FloatArray, known: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Sessions of drift alone (b, n), each with strengths drawn from what this axis' blocks say of them."""
    projectors = zip(slow.grid, profiled(slow.grid, known), strict=True)
    values = [-0.5 * (float(residual @ projector @ residual) + point.logdet) for point, projector in projectors]
    weight = np.exp(np.array(values) - logsumexp(values))
    count = rng.multinomial(DRAWS, weight)
    parts = [
        np.tril(slow.factor(point.strengths)[0]) @ rng.standard_normal((len(residual), k))
        for point, k in zip(slow.grid, count, strict=True)
        if k
    ]
    return rng.permutation(np.concatenate(parts, axis=1), axis=1)
