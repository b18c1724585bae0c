"""Steps of the bias: means over a few seconds, against the line through those before."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gsense_fusion.identification.types import FloatArray

from .window import same_mounting

NEWEST = 3
GUARD = 1
"""Means between the newest and those before: one that a step cut in two belongs to neither."""
FEWEST_BEFORE = 5
FEWEST_SCALES = 5
MOST_BEFORE = 12
THRESHOLD = 8.0
"""In standard errors of the difference; their scale is itself estimated from few means."""
FLOOR = 2e-5
"""Least standard deviation of a mean, rad/s: flicker of a good MEMS gyro."""


@dataclass(frozen=True)
class Level:
    """Mean of the residual over a stretch without the drive's part."""

    time: float
    """s, its middle."""
    mean: FloatArray
    """rad/s, shape (3,)."""


@dataclass(frozen=True)
class Step:
    """A step of the mean."""

    time: float
    """s, when about."""
    size: FloatArray
    """rad/s, shape (3,)."""


@dataclass
class Levels:
    """Means in one mounting, at rest and in motion: a complete model leaves the same mean in both."""

    up: FloatArray | None = None
    history: list[Level] = field(default_factory=list)
    scales: list[float] = field(default_factory=list)
    """Deviations of single means from the line through those before, rad/s, oldest first."""

    def add(self, level: Level, up: FloatArray | None) -> Step | None:
        """Take the newest mean; a step where the newest three left the line through the earlier ones."""
        if not same_mounting(up, self.up):  # other columns of G come into play, and the bias was seen without them
            self.history.clear()
            self.up = None
        self.up = up if self.up is None else self.up
        self.history.append(level)
        before, newest = self.history[: -NEWEST - GUARD][-MOST_BEFORE:], self.history[-NEWEST:]
        if len(before) < FEWEST_BEFORE:
            return None
        t = np.array([b.time for b in before])
        means = np.array([b.mean for b in before])
        middle, square = t.mean(), float(np.sum((t - t.mean()) ** 2))
        centre, slope = means.mean(axis=0), (t - middle) @ means / square
        off = np.array([new.mean - centre - slope * (new.time - middle) for new in newest])
        left = means - centre - np.outer(t - middle, slope)
        spread = np.sqrt(np.sum(left**2, axis=0) / (len(t) - 2))
        reach = (newest[-1].time - middle) ** 2 / square
        settled = self.scales[: 1 - NEWEST]  # the others have seen what is tested now: a step would hide itself
        usual = float(np.median(settled)) if len(settled) >= FEWEST_SCALES else 0.0
        scale = np.maximum(np.maximum(spread, usual), FLOOR)
        size = off.mean(axis=0)
        score = np.abs(size) / (scale * np.sqrt(1.0 / NEWEST + 1.0 / len(t) + reach))
        whole = (off / np.where(size == 0.0, 1.0, size)).min(axis=0) > 0.5  # each of the newest shares it
        if np.any(whole & (score > THRESHOLD)):
            self.history = self.history[-1:]
            return Step(newest[0].time, size)
        one = np.abs(off[-1]) / np.sqrt(1.0 + 1.0 / len(t) + reach)
        self.scales = [*self.scales[-50:], float(np.median(one)) / 0.6745]
        return None
