"""Samples that a recording lacks, told by the stamps of a steady stream."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_GAP = 1.5
"""Periods between neighbours from which on a sample is missing."""


@dataclass(frozen=True)
class Gaps:
    """What is missing between the first and the last sample."""

    missing: int
    count: int
    longest: float
    """s from one sample to the next."""


def find_gaps(stamp_ns: NDArray[np.int64], repeated: int = 0) -> Gaps:
    """Gaps of a stream.

    Args:
        stamp_ns: stamps in ns, increasing, shape (n,).
        repeated: messages with the stamp of their neighbour that were dropped before: a sensor that is read faster than
            it samples leaves as many holes, and nothing is lost.
    """
    if len(stamp_ns) < 3:
        return Gaps(0, 0, 0.0)
    steps = np.diff(stamp_ns).astype(np.float64)
    periods = steps / np.median(steps)
    missing = count = 0
    for start, end in wide_stretches(periods):
        lacking = round(float(periods[start:end].sum()) - (end - start))
        if lacking > 0:
            missing += lacking
            count += 1
    if missing <= repeated:
        return Gaps(0, 0, 0.0)
    return Gaps(missing - repeated, count, float(steps.max()) * 1e-9)


def wide_stretches(periods: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Stretches around wide steps, each as many steps to either side as it is periods wide.

    A sample that is only late makes a wide step and then short ones: over the stretch nothing is missing.
    """
    windows: list[tuple[int, int]] = []
    for at in np.flatnonzero(periods > _GAP).tolist():
        reach = round(float(periods[at]))
        start, end = max(0, at - reach), min(len(periods), at + 1 + reach)
        if windows and start < windows[-1][1]:
            windows[-1] = (windows[-1][0], max(end, windows[-1][1]))
        else:
            windows.append((start, end))
    return windows
