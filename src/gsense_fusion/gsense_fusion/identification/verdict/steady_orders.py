"""High orders of a steady drive, taken out of a residual as the sines they are.

Above the band in which models are fitted no test looks at them, but a hundred times the noise in a line is some tenths
of it in the bins between: a window that ends at any phase leaks.
"""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.likelihood.bins import HIGHEST_HZ
from gsense_fusion.identification.motion.felt_harmonics import told_apart
from gsense_fusion.identification.motion.harmonics import WORST_CONDITION
from gsense_fusion.identification.motion.phasors import Phasors
from gsense_fusion.identification.types import FloatArray

SAMPLES_PER_ORDER = 5
STANDS_OUT = 4.0
"""Times the power of the noise beside it, that make an order a line. What is less leaks some hundredths of the noise
into the bins between; taking all orders out would take a part of the noise there with them."""
BESIDE_BINS = 30
"""On either side, that tell the noise at an order."""


def without_high_orders(series: FloatArray, angular_frequency: float, rate_hz: float, reached: float) -> FloatArray:
    """Some series (n, c) of one window without the lines at orders above the band of the fit, shape (n, c).

    Args:
        series: Of the gyro or the accelerometer, equidistant.
        angular_frequency: Of the drive, rad/s.
        rate_hz: Samples a second.
        reached: Up to which part of that the orders are taken out; what is above half of it folds.

    """
    n = len(series)
    order_hz = angular_frequency / (2 * np.pi)
    lowest, most = int(HIGHEST_HZ / order_hz) + 1, int(reached * rate_hz / order_hz)
    if most < lowest or most - lowest + 1 > n // SAMPLES_PER_ORDER:
        return series
    orders = told_apart(np.arange(lowest, most + 1.0), angular_frequency, n / rate_hz, rate_hz).astype(np.int64)
    if not len(orders):
        return series
    phasors = Phasors.of(angular_frequency / rate_hz * np.arange(n))
    matrix = phasors.normal_matrix(orders)
    try:
        inverse = np.linalg.inv(matrix)
    except np.linalg.LinAlgError:
        return series
    if np.linalg.norm(matrix, 1) * np.linalg.norm(inverse, 1) > WORST_CONDITION:
        return series
    found = phasors.sums(series.T, orders)
    right = np.concatenate([series.sum(axis=0)[None], found.real.T, found.imag.T])
    beta = (inverse @ right)[1:]
    size = beta[: len(orders)] - 1j * beta[len(orders) :]
    noise = series - phasors.oscillation(size.T, orders).T
    lines = size * (np.abs(n / 2 * size) ** 2 > STANDS_OUT * _power_beside(noise, orders * order_hz, rate_hz))
    return np.asarray(series - phasors.oscillation(lines.T, orders).T)


def _power_beside(noise: FloatArray, frequencies_hz: FloatArray, rate_hz: float) -> FloatArray:
    """Mean square of the Fourier coefficients of series (n, c) beside some frequencies (k,), shape (k, c)."""
    power = np.abs(np.fft.rfft(noise, axis=0)) ** 2
    total = np.concatenate([np.zeros((1, power.shape[1])), np.cumsum(power, axis=0)])
    folded = np.abs(frequencies_hz - rate_hz * np.rint(frequencies_hz / rate_hz))
    middle = np.rint(folded * len(noise) / rate_hz).astype(np.int64)
    low, high = np.maximum(middle - BESIDE_BINS, 1), np.minimum(middle + BESIDE_BINS + 1, len(power))
    return np.asarray((total[high] - total[low]) / (high - low)[:, None])
