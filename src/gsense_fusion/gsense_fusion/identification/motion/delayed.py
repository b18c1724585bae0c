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
    """Coefficients of each cubic piece, the highest power first, shape (4, k, pieces)."""
    samples: int
    every: int
    """Pieces from one sample to the next."""
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
        knots = time[0] + step * np.arange(-first, (len(time) - 1) * every + first + 2)
        pieces = CubicSpline(knots, series_at(knots), axis=1).c.transpose(0, 2, 1)
        return Delayed(np.ascontiguousarray(pieces), len(time), every, first, step)

    def by(self, delay_s: float) -> FloatArray:
        """The series later by a delay, shape (k, n)."""
        whole = int(np.floor(-delay_s / self.step_s))
        rest = -delay_s - whole * self.step_s
        begin = self.first + whole
        cubic, square, slope, level = self.pieces[
            :, :, begin : begin + (self.samples - 1) * self.every + 1 : self.every
        ]
        return np.asarray(((cubic * rest + square) * rest + slope) * rest + level)
