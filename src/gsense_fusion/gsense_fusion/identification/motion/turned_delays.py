"""Delays of runs in which the carriage tilts with its speed: gravity then looks like a delay that falls with w^2.

A tilt c v about the level axis across the rail adds g c v to the acceleration along the rail; at the drive's frequency
v = -j / w^2, so the accelerometer looks late by g c / w^2. No clock does that. It is told from the runs' own delays by
its dependence on the frequency, and taken out of them, or the gyro's drivers would be moved by it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsense_fusion.identification.motion.mounting import Delay, RunGeometry
from gsense_fusion.identification.types import GRAVITY, FloatArray

CLEARLY = 5.0
"""Standard errors by which the dependence on the frequency must differ from zero."""
LARGEST_TILT = 0.02
"""rad/(m/s): more is no carriage."""
MIN_RUNS = 4
ROUNDS = 20


def without_turns(geometry: Sequence[RunGeometry], frequencies: Sequence[float | None]) -> list[RunGeometry]:
    """The runs' geometry with delays that do not follow 1 / w^2; unchanged where they do not clearly.

    Args:
        geometry: Of each run.
        frequencies: Of its drive in rad/s.

    """
    known = [
        i for i, (g, w) in enumerate(zip(geometry, frequencies, strict=True)) if g.delay is not None and w is not None
    ]
    if len(known) < MIN_RUNS or len({round(frequencies[i] or 0.0, 1) for i in known}) < MIN_RUNS:
        return list(geometry)
    late = np.array([geometry[i].delay.value for i in known])  # type: ignore[union-attr]
    sigma = np.array([geometry[i].delay.stderr for i in known])  # type: ignore[union-attr]
    inverse = np.array([1.0 / (frequencies[i] or 1.0) ** 2 for i in known])
    slope, stderr = _slope(inverse, late, sigma)
    if abs(slope) < CLEARLY * stderr or abs(slope) > LARGEST_TILT * GRAVITY:
        return list(geometry)
    out = list(geometry)
    for i, x in zip(known, inverse, strict=True):
        old = geometry[i].delay
        if old is not None:
            out[i] = replace(geometry[i], delay=Delay(old.value - slope * x, float(np.hypot(old.stderr, stderr * x))))
    return out


def _slope(x: FloatArray, y: FloatArray, sigma: FloatArray) -> tuple[float, float]:
    """Slope of y over x with its error; the scatter that the runs have beyond their own errors is estimated with it."""
    X = np.column_stack([np.ones(len(x)), x])
    spread = 0.0
    beta, covariance = np.zeros(2), np.zeros((2, 2))
    for _ in range(ROUNDS):
        weight = 1.0 / (sigma**2 + spread**2)
        covariance = np.linalg.inv((X.T * weight) @ X)
        beta = covariance @ ((X.T * weight) @ y)
        excess = float(np.sum(weight * (y - X @ beta) ** 2)) / (len(x) - 2)
        if excess <= 1.0:
            break
        spread = float(np.sqrt(max(spread**2, np.min(sigma) ** 2) * excess))
    return float(beta[1]), float(np.sqrt(covariance[1, 1]))
