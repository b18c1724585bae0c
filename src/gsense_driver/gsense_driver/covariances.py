"""Covariances of the published fields, from noise densities."""

from __future__ import annotations

import math

NOT_REPORTED = -1.0  # element 0 of the covariance of a field that the message does not carry (REP-145)
UNKNOWN_AXIS = 1e6  # variance of an axis that the sensor does not measure


def white_noise_variance(density: float, bandwidth_hz: float) -> float:
    """Variance behind a first-order low-pass: density^2 * pi/2 * bandwidth; density in unit/sqrt(Hz)."""
    return density * density * 0.5 * math.pi * bandwidth_hz


def diagonal(x: float, y: float, z: float) -> list[float]:
    """Row-major 3x3 with this diagonal, as messages carry it."""
    return [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z]
