"""The residual above the drive's first orders, in time: what noise that changes along a run is seen in."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.types import BoolArray, FloatArray
from gsense_fusion.identification.verdict.residual import WindowResidual

LOWEST_HZ = 5.0


def fast_part(residual: WindowResidual, highest_hz: float = np.inf) -> FloatArray:
    """Whitened residual above 5 Hz and away from the drive's orders in time, variance one at rest, shape (n, 3)."""
    n = len(residual.window)
    used = away_above(residual, highest_hz)
    spectrum = np.zeros((n // 2 + 1, 3), dtype=complex)
    values = (residual.spectrum[0] + 1j * residual.spectrum[1]) * used[:, None]
    spectrum[np.flatnonzero(residual.bins.keep)] = values
    series = np.fft.irfft(spectrum, n, axis=0)
    return np.asarray(series * n / np.sqrt(4.0 * max(int(used.sum()), 1)))


def away_above(residual: WindowResidual, highest_hz: float = np.inf) -> BoolArray:
    """Bins that are looked at, shape (m,)."""
    inside = (residual.frequency >= LOWEST_HZ) & (residual.frequency < highest_hz)
    return np.asarray(residual.away_from_orders() & inside)


def in_blocks(series: FloatArray, length: int) -> FloatArray:
    """Means over `length` samples each of a series (n, c), what is left over at the end dropped."""
    n = len(series) // length * length
    return np.asarray(series[:n].reshape(-1, length, series.shape[1]).mean(axis=1))
