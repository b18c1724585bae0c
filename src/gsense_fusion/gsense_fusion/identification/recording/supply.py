"""The supply voltage of a run, without the noise of its readings as far as that goes."""

from __future__ import annotations

import numpy as np

from gsense_fusion.bags.run import ScalarSeries
from gsense_fusion.identification.types import FloatArray

READINGS = 5
"""Of a running mean."""
SPREAD = 10.0
"""Standard deviations that the running means of a steady supply may lie apart."""
SLOPE_SIGMA = 4.0
"""From which a discharge within the run is taken for one."""


def supply_of(series: ScalarSeries | None, epoch_ns: int, time: FloatArray) -> FloatArray | None:
    """Volts at the times (n,); None for fewer than five readings.

    A supply that moves by more than its readings scatter (one that is toggled) is their running mean. The readings of a
    cell scatter by more than it discharges in a session: left in, their noise is a supply that the gyro does not
    follow, and what it does follow is lost. Then the run has its mean, or a line where it shows one.

    Args:
        series: Readings.
        epoch_ns: Zero of the times.
        time: s.

    """
    if series is None or len(series.stamp_ns) < READINGS or not np.isfinite(series.value).all():
        return None
    at = (series.stamp_ns - epoch_ns) * 1e-9
    half = READINGS // 2
    mean = np.convolve(np.pad(series.value, half, mode="edge"), np.full(READINGS, 1.0 / READINGS), mode="valid")
    scatter = float(np.sqrt(np.mean(np.diff(series.value) ** 2) / 2.0))
    middle = at - at.mean()
    slope = float(middle @ series.value / (middle @ middle))
    line = series.value.mean() + slope * middle
    if np.ptp(mean - line) > SPREAD * scatter / np.sqrt(READINGS):
        return np.asarray(np.interp(time, at, mean), dtype=float)
    if abs(slope) < SLOPE_SIGMA * scatter / np.sqrt(middle @ middle):
        slope = 0.0
    return np.asarray(series.value.mean() + slope * (time - at.mean()), dtype=float)
