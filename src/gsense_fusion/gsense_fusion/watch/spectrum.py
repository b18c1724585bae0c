"""What noise does away from the drive's orders: tones, and its level."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter

from gsense_fusion.identification.types import BoolArray, FloatArray

from .orders import USED_BAND

LINE_OVER_LEVEL = 40.0
"""Power of a bin over the mean beside it: exp(-40) in noise, and there are 2000 bins in a window."""
LOWEST_HZ = 2.0
LEVEL_SPAN = 101


@dataclass(frozen=True)
class Spectrum:
    """Remainder of one window."""

    lines: FloatArray
    """Frequencies of tones, Hz."""
    density: FloatArray
    """Mean one-sided power density above `LOWEST_HZ`, (rad/s)^2/Hz, shape (3,)."""
    resolution_hz: float


def spectrum_of(remainder: FloatArray, rate_hz: float, drive_hz: float | None) -> Spectrum:
    """Tones and level of a remainder (n, 3); what lies at a whole order of the drive is no tone."""
    n = len(remainder)
    window = np.hanning(n)[:, None]
    power = np.abs(np.fft.rfft(remainder * window, axis=0)) ** 2
    frequency = np.fft.rfftfreq(n, 1.0 / rate_hz)
    used = (frequency > LOWEST_HZ) & (frequency < USED_BAND * rate_hz)
    f, p = frequency[used], power[used]
    span = min(LEVEL_SPAN, len(f) // 2 * 2 - 1)
    level = median_filter(p, size=(span, 1)) / np.log(2.0)  # median of an exponential
    over = (p / np.maximum(level, 1e-30)).max(axis=1)
    over[_at_orders(f, drive_hz, 2.5 * rate_hz / n)] = 0.0
    found = np.flatnonzero(over > LINE_OVER_LEVEL)
    peaks = [i for i in found if over[i] == over[max(0, i - 3) : i + 4].max()]
    density = 2.0 * np.median(p, axis=0) / np.log(2.0) / (rate_hz * np.sum(window**2))
    return Spectrum(f[peaks], density, rate_hz / n)


def _at_orders(frequency: FloatArray, drive_hz: float | None, width_hz: float) -> BoolArray:
    """Bins at whole orders of the drive; of a slow drive whose orders lie side by side only the first twenty."""
    if drive_hz is None:
        return np.zeros(len(frequency), dtype=bool)
    order = frequency / drive_hz
    near = np.abs(order - np.rint(order)) * drive_hz < width_hz
    return np.asarray(near & (order < (np.inf if drive_hz > 4 * width_hz else 20.0)))
