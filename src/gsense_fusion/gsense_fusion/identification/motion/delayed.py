"""A run's series as they were a while ago, on its own grid: every sample is as far behind a knot as the first one.

A delay is searched for: tens of values, each on all runs. A spline that is asked at any instants looks each of them up.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from gsense_fusion.identification.types import FloatArray

LONGEST_S = 0.3
"""Delays and advances up to this."""


@dataclass(frozen=True, eq=False)
class Delayed:
    """Series at the n samples of an equidistant grid, at any delay up to `LONGEST_S`."""

    pieces: FloatArray
    """Coefficients of each cubic piece, the highest power first, shape (4, every, k, m).

    Pieces that are as far behind a sample stand together, `every` such rows of them.
    """
    samples: int
    first: int
    """The piece that begins at the first sample."""
    step_s: float
    """Length of a piece."""

    @staticmethod
    def of(time: FloatArray, rate_hz: float, series_at: Callable[[FloatArray], FloatArray], least_hz: float) -> Delayed:
        """Interpolate series.

        Args:
            time: The grid, s, shape (n,).
            rate_hz: Its rate.
            series_at: The series at any times (m,), shape (k, m).
            least_hz: Knots per second, at least.

        """
        every = max(1, int(np.ceil(least_hz / rate_hz - 1e-6)))
        step = 1.0 / (rate_hz * every)
        first = int(np.ceil(LONGEST_S / step))
        count = (len(time) - 1) * every + 2 * first + 1
        count += -count % every
        knots = time[0] + step * np.arange(-first, count + 1 - first)
        pieces = CubicSpline(knots, series_at(knots), axis=1).c
        pieces = pieces.reshape(4, -1, every, pieces.shape[2]).transpose(0, 2, 3, 1)
        return Delayed(np.ascontiguousarray(pieces), len(time), first, step)

    def by(self, delay_s: float) -> FloatArray:
        """The series later by a delay, shape (k, n)."""
        whole = int(np.floor(-delay_s / self.step_s))
        rest = -delay_s - whole * self.step_s
        begin, row = divmod(self.first + whole, self.pieces.shape[1])
        cubic, square, slope, level = self.pieces[:, row, :, begin : begin + self.samples]
        out = cubic * rest
        for term in (square, slope):
            out += term
            out *= rest
        out += level
        return np.asarray(out)
