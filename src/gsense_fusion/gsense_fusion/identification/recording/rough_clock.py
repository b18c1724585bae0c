"""How far two clocks ran apart over a session, roughly: from when each of them saw the carriage start and stop.

Where they differ by tenths of a per cent, the IMU's stamps are soon a period of the drive off the encoder's, and a
delay between two sines is only known up to whole periods (and half ones: the board's direction is not known yet).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import uniform_filter1d

from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import FloatArray

FEWEST_RUNS = 4
SMOOTHED_S = 0.4
PART_OF_PEAK = 0.2
QUIET_PART = 0.1
"""Of the peak: a run whose level at rest is higher does not tell when it started."""
FAR_S = 0.2
"""Delays that differ by less are found without this."""
SCATTER_S = 0.15
"""Delays that lie farther off one line, in the median, show no two clocks."""


def rough_skew(runs: Sequence[CleanRun]) -> float | None:
    """How much faster than the encoder's clock the IMU's runs; None where the two stay together or nothing tells."""
    found = [(r.session, float(r.time.mean()), x) for r in runs if (x := _late(r)) is not None]
    if len(found) < FEWEST_RUNS:
        return None
    session, time, late = (np.array(x) for x in zip(*found, strict=True))
    pairs = [(i, j) for i, j in itertools.combinations(range(len(found)), 2) if session[i] == session[j]]
    if len(pairs) < FEWEST_RUNS or float(np.ptp(late)) < FAR_S:
        return None
    slope = float(np.median([(late[j] - late[i]) / (time[j] - time[i]) for i, j in pairs]))
    left = late - slope * time
    left = left - np.array([np.median(left[session == s]) for s in session])
    scatter = float(np.median(np.abs(left)))
    reach = max(float(np.ptp(time[session == s])) for s in set(session.tolist()))
    return slope if scatter < SCATTER_S and abs(slope) * reach > max(FAR_S, 3 * scatter) else None


def _late(run: CleanRun) -> float | None:
    """How much later the IMU's clock has the motion's middle than the encoder's, s."""
    if run.pose is None or run.pose_time is None or not np.isfinite(run.specific_force).all():
        return None
    felt = np.linalg.norm(run.specific_force - np.median(run.specific_force, axis=0), axis=1)
    speed = np.abs(np.gradient(run.pose))
    imu, encoder = _middle(run.time, felt), _middle(run.pose_time, speed)
    return None if imu is None or encoder is None else imu - encoder


def _middle(time: FloatArray, size: FloatArray) -> float | None:
    """Middle between the first and last time at which a size (n,) exceeds a part of its peak."""
    smooth = uniform_filter1d(size, max(1, round(SMOOTHED_S / float(np.median(np.diff(time))))))
    peak, quiet = np.percentile(smooth, (95.0, 5.0))
    over = np.flatnonzero(smooth > PART_OF_PEAK * peak)
    if quiet > QUIET_PART * peak or len(over) < 2 or over[0] == 0 or over[-1] == len(smooth) - 1:
        return None
    return float(time[over[0]] + time[over[-1]]) / 2
