"""How large the part of G may be that no mounting of the board has shown."""

from __future__ import annotations

import numpy as np
from scipy import stats

from gsense_fusion.identification.types import FloatArray

TYPICAL_G = np.deg2rad(0.1) / 9.80665
"""Standard deviation of an element of G of a cheap MEMS gyro (0.1 deg/s/g, MPU-6050 data sheet), (rad/s)/(m/s^2)."""
TYPICAL_WEIGHT = 1
"""So many elements seen speak as loudly of this sensor's G as what is typical: sensors differ by a factor of ten."""
UNSEEN_PART = 0.5
"""Of its plausible variance: a direction that keeps more is one that the data does not show."""


def unseen_variance(g: FloatArray, covariance: FloatArray, unit: FloatArray) -> FloatArray:
    """What the size of this sensor's own G changes in the variance of its elements.

    A direction of G that was not shown counts in `covariance` with its plausible size, whatever the rest of G came to,
    and a mounting a few degrees askew carries it into the elements that were. A sensor with a large G in the column
    that was shown has a large one in the others too: elements are taken as normal with one unknown variance, whose
    estimate from few of them makes what is unseen Student's (conjugate prior, Gelman et al., BDA, chapter 3).

    Args:
        g: Elements of G, shape (9,), (rad/s)/(m/s^2).
        covariance: Of them, shape (9, 9).
        unit: Their plausible sizes, shape (9,).

    Returns:
        To add to the diagonal of `covariance`, shape (9,); negative where this sensor's G is small.

    """
    values, vectors = np.linalg.eigh(covariance / (unit[:, None] * unit[None]))
    unseen = values > UNSEEN_PART
    seen = vectors[:, ~unseen].T @ g
    if unseen.all() or not unseen.any():
        return np.zeros(len(g))
    freedom = TYPICAL_WEIGHT + len(seen)
    variance = float(TYPICAL_WEIGHT * TYPICAL_G**2 + seen @ seen) / freedom
    tails = float(stats.t.ppf(0.975, freedom) / stats.norm.ppf(0.975))
    return np.asarray((vectors[:, unseen] ** 2 @ values[unseen]) * (variance * tails**2 - unit**2))
