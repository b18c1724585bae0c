"""Is this stretch of samples at rest, and what does it tell?"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from .interface import FloatArray

STANDARD_GRAVITY = 9.80665


@dataclass(frozen=True)
class RestLimits:
    """What still counts as rest; wide enough for the noise of the sensors in use, and for a motor that hums."""

    rate_deviation: float = radians(1.0)
    """rad/s, largest standard deviation of an axis. The MPU-6050 has 0.05 deg/s at 200 Hz, the LISY300 0.3 deg/s."""
    rate_mean: float = radians(25.0)
    """rad/s, largest mean of an axis: a bias; the datasheet of the MPU-6050 allows 20 deg/s."""
    rate_drift: float = radians(0.3)
    """rad/s, largest difference of the means of the two halves: a slow turn that begins or ends."""
    force_deviation: float = 0.3
    """m/s^2, largest standard deviation of an axis (MPU-6050: 0.04 at 200 Hz)."""
    force_drift: float = 0.05
    """m/s^2, largest difference of the means of the two halves: slow motion on the rail, tilting."""
    gravity: float = 0.15
    """Largest relative difference of the mean specific force from 9.80665 m/s^2."""


def is_rest(angular_rate: FloatArray, specific_force: FloatArray, limits: RestLimits | None = None) -> bool:
    """Whether n samples (about a second) are at rest.

    Args:
        angular_rate: rad/s, shape (n, 3).
        specific_force: m/s^2, shape (n, 3); NaN where there is no accelerometer: the rate alone decides.
        limits: thresholds.
    """
    limits = limits or RestLimits()
    if len(angular_rate) < 8:
        return False
    if (
        np.any(np.std(angular_rate, axis=0) > limits.rate_deviation)
        or np.any(np.abs(np.mean(angular_rate, axis=0)) > limits.rate_mean)
        or _half_difference(angular_rate) > limits.rate_drift
    ):
        return False
    if np.isnan(specific_force).all():
        return True
    norm = float(np.linalg.norm(np.mean(specific_force, axis=0)))
    return bool(
        np.all(np.std(specific_force, axis=0) <= limits.force_deviation)
        and _half_difference(specific_force) <= limits.force_drift
        and abs(norm / STANDARD_GRAVITY - 1.0) <= limits.gravity
    )


def _half_difference(values: FloatArray) -> float:
    middle = len(values) // 2
    return float(np.max(np.abs(np.mean(values[:middle], axis=0) - np.mean(values[middle:], axis=0))))
