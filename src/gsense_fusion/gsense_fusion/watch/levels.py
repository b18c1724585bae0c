"""Steps of the bias: means over a few seconds, against the line through those before."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gsense_fusion.identification.types import FloatArray

from .window import same_mounting

NEWEST = 3
FEWEST_BEFORE = 5
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
    """Deviations of means from the line through those before, rad/s."""

    def add(self, level: Level, up: FloatArray | None) -> Step | None:
        """Take the newest mean; a step where the newest three left the line through the earlier ones."""
        if not same_mounting(up, self.up):  # other columns of G come into play, and the bias was seen without them
            self.history.clear()
            self.up = None
        self.up = up if self.up is None else self.up
        self.history.append(level)
        before, newest = self.history[-MOST_BEFORE - NEWEST : -NEWEST], self.history[-NEWEST:]
        if len(before) < FEWEST_BEFORE:
            return None
        t = np.array([b.time for b in before])
        line = np.polynomial.Polynomial.fit
        means = np.array([b.mean for b in before])
        fits = [line(t, means[:, axis], 1) for axis in range(3)]
        off = np.array([[new.mean[a] - fits[a](new.time) for a in range(3)] for new in newest])
        spread = np.std(means - np.column_stack([fit(t) for fit in fits]), axis=0, ddof=2)
        usual = float(np.median(self.scales)) if self.scales else 0.0
        scale = np.maximum(np.maximum(spread, usual), FLOOR)
        reach = (newest[-1].time - t.mean()) ** 2 / np.sum((t - t.mean()) ** 2)
        size = off.mean(axis=0)
        score = np.abs(size) / (scale * np.sqrt(1.0 / NEWEST + 1.0 / len(t) + reach))
        whole = (off / np.where(size == 0.0, 1.0, size)).min(axis=0) > 0.5  # each of the newest shares it
        if np.any(whole & (score > THRESHOLD)):
            self.history = self.history[-1:]
            return Step(newest[0].time, size)
        self.scales = [*self.scales[-50:], float(np.median(np.abs(off[-1]))) / 0.6745]
        return None
