"""Series of one run reduced to a few orders of the drive: all that the accelerometer says of a turning carriage.

The carriage's own acceleration and the ringing of its belt are thousands of times larger than what gravity changes when
the carriage turns by a millidegree, so leakage matters more than a few per cent of the noise: whole periods, a taper,
and all low orders and half-orders fitted together.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal.windows import tukey

from gsense_fusion.identification.campaign import RunData
from gsense_fusion.identification.effects.design import Mixed
from gsense_fusion.identification.types import BoolArray, FloatArray

USED_ORDERS = (1, 2, 3)
"""Turns over position, speed and direction of travel show here; higher ones belong to the belt."""
FITTED_ORDERS = 10
BETWEEN = (0.5, 1.5, 2.5)
"""Half-orders, where nothing belongs: they say how noisy the accelerometer is in motion."""
PERIODS_FOR_HALVES = 6
MIN_PERIODS = 2
HIGHEST_HZ = 5.0
USED_PART = 0.2
"""Of the sample rate: above, the sensor's filter is no short series in frequency."""
TAPERED = 0.2


@dataclass(frozen=True, eq=False)
class OrderProjection:
    """Cosine and sine amplitudes of a series at orders of the drive, by weighted least squares."""

    start: int
    stop: int
    matrix: FloatArray
    """Times samples start to stop gives cosines, then sines, of all `orders`, shape (2 k, n)."""
    orders: FloatArray
    """Shape (k,): whole ones first."""
    angular_frequency: float
    """rad/s."""
    spread: FloatArray
    """Standard deviation of each row for white noise of unit variance, shape (2 k,)."""

    @property
    def frequency_hz(self) -> FloatArray:
        """Of each row, shape (2 k,)."""
        return np.tile(self.orders, 2) * self.angular_frequency / (2 * np.pi)

    @property
    def whole(self) -> BoolArray:
        """Rows of whole orders, shape (2 k,)."""
        return np.asarray(np.tile(self.orders == np.rint(self.orders), 2))

    def of(self, series: FloatArray) -> FloatArray:
        """Amplitudes of a series (n_run, ...) of the run, shape (2 k, ...)."""
        cut = series[self.start : self.stop]
        flat = self.matrix @ cut.reshape(len(cut), -1)
        return np.asarray(flat.reshape(len(self.matrix), *series.shape[1:]))

    def of_design(self, design: Mixed) -> FloatArray:
        """Amplitudes of a design's columns, shape (2 k, 3, p)."""
        return np.asarray(np.tensordot(self.of(design.series.T), design.spread, axes=1))

    def derivative(self, rows: FloatArray) -> FloatArray:
        """Amplitudes of the derivative by time of what has the amplitudes `rows` (2 k, ...)."""
        k = len(self.orders)
        w = (self.orders * self.angular_frequency).reshape(-1, *[1] * (rows.ndim - 1))
        return np.concatenate([rows[k:] * w, -rows[:k] * w])


def project_orders(data: RunData) -> OrderProjection | None:
    """The projection of a run in periodic motion; None where too few periods are steady."""
    window = next((w for w in data.windows if w.moving), None)
    motion = data.motion
    if window is None or motion is None or motion.angular_frequency is None:
        return None
    w, rate = motion.angular_frequency, data.run.rate_hz
    samples = 2 * np.pi / w * rate
    periods = int(len(window) / samples)
    top = min(HIGHEST_HZ, USED_PART * rate) * 2 * np.pi / w
    used = [o for o in USED_ORDERS if o <= top]
    if periods < MIN_PERIODS or not used:
        return None
    n = min(len(window), round(periods * samples))
    halves = [h for h in BETWEEN if periods >= PERIODS_FOR_HALVES and h <= top]
    highest = max(used[-1], min(FITTED_ORDERS, int(0.45 * rate * 2 * np.pi / w)))
    orders = np.array([*used, *halves, *(o for o in range(1, highest + 1) if o not in used)], dtype=float)
    t = (np.arange(n) - (n - 1) / 2) / rate
    phase = np.outer(t, w * orders)
    slow = 2 * t / t[-1]
    X = np.column_stack([np.cos(phase), np.sin(phase), np.ones(n), slow, slow**2])
    weighted = X.T * tukey(n, TAPERED)
    matrix = np.linalg.solve(weighted @ X, weighted)
    kept = len(used) + len(halves)
    rows = np.concatenate([np.arange(kept), len(orders) + np.arange(kept)])
    matrix = matrix[rows]
    return OrderProjection(window.start, window.start + n, matrix, orders[:kept], w, np.sqrt(np.sum(matrix**2, axis=1)))
