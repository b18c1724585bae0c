"""What an encoder's readings leave of a sine: the drive's own unsteadiness, or stamps that jitter.

A stamp that is a millisecond off is 1 mm off at 1 m/s, each reading by itself: an average over some hundred periods
takes it out. A drive that wanders is off for a good part of a period at a time.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from gsense_fusion.identification.types import FloatArray

FIRST_LAG = 3
"""Readings: interpolation between them makes nearer ones alike."""
PART_OF_PERIOD = 24
"""Of which a drive's deviation hardly changes."""
SURE = 3.0


def lasting_rms(rest: FloatArray, period: float) -> float:
    """Deviation that is still there some readings later, as far as it is sure.

    Args:
        rest: What a fit leaves of equidistant readings, shape (n,).
        period: Of the drive, in readings.

    Returns:
        Standard deviation of the lasting part less what chance makes of it, in the unit of `rest`; all of it where the
        readings are too few a period to tell.

    """
    lags = np.arange(FIRST_LAG, int(period / PART_OF_PERIOD) + 1)
    centred = rest - rest.mean()
    power = float(centred @ centred) / len(rest)
    if not len(lags) or len(rest) <= lags[-1]:
        return float(np.sqrt(power))
    lasting = float(np.mean([centred[k:] @ centred[:-k] / (len(rest) - k) for k in lags]))
    chance = SURE * power / np.sqrt(len(rest) * len(lags))
    return float(np.sqrt(max(lasting - chance, 0.0)))


def smoothed(rest: FloatArray, period: float) -> FloatArray:
    """The same averaged over as many readings as the drive's deviation lasts, shape (n,)."""
    return uniform_filter1d(rest, max(1, int(period / PART_OF_PERIOD)))
