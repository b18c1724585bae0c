"""The samples' places on a uniform grid: which are missing, which came twice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gsense_fusion.bags.gaps import wide_stretches
from gsense_fusion.bags.run import LinkCounts
from gsense_fusion.identification.recording.jitter import STRONG, STRONGEST, numbered, strength
from gsense_fusion.identification.types import FloatArray, IntArray

BY_CHANCE = 10.0
"""Times the number of equal neighbours that chance explains: from here on samples are repeated."""


@dataclass(frozen=True)
class Stamps:
    """Missing and repeated samples of one run."""

    received: int = 0
    missing: int = 0
    gaps: int = 0
    longest_s: float = 0.0
    """The longest gap: time without a sample beyond the usual period."""
    repeated: int = 0
    """Samples that equal their predecessor in every channel, beyond chance."""
    link: LinkCounts | None = None
    """What the board's frame counter says; None without a link topic."""


def grid_index(stamp_ns: IntArray) -> tuple[IntArray, float]:
    """Number the samples on a uniform grid; a lost sample leaves its number out, a late one does not.

    Args:
        stamp_ns: Strictly increasing stamps, shape (n,).

    Returns:
        The grid number of each sample, shape (n,), and the period in s.

    """
    periods = np.diff(stamp_ns).astype(float)
    periods /= float(np.median(periods))
    index = numbered(periods) if STRONG < strength(periods) < STRONGEST else _counted(periods)
    slope = np.polyfit(index.astype(float), (stamp_ns - stamp_ns[0]).astype(float), 1)[0]
    return index, float(slope) * 1e-9


def _counted(periods: NDArray[np.float64]) -> IntArray:
    """Grid numbers (n,) where the steps themselves, (n - 1,) in periods, tell what is missing."""
    steps = np.ones(len(periods), dtype=np.int64)
    for start, stop in wide_stretches(periods):
        lacking = round(float(periods[start:stop].sum()) - (stop - start))
        if lacking > 0:
            _share_out(steps[start:stop], periods[start:stop], lacking)
    return np.concatenate([[0], np.cumsum(steps)]).astype(np.int64)


def _share_out(steps: IntArray, periods: FloatArray, lacking: int) -> None:
    """Put the missing samples of a stretch where it is widest; late samples round up here and down there."""
    excess = np.maximum(periods - 1.0, 0.0)
    missing = np.rint(excess).astype(np.int64)
    while (off := lacking - int(missing.sum())) != 0:
        worst = excess - missing if off > 0 else np.where(missing > 0, missing - excess, -np.inf)
        missing[int(np.argmax(worst))] += np.sign(off)
    steps += missing


def look_at_stamps(index: IntArray, period_s: float, values: FloatArray, link: LinkCounts | None = None) -> Stamps:
    """Count what is missing and what came twice.

    Args:
        index: Grid numbers of the samples, shape (n,).
        period_s: Of the grid.
        values: All channels, shape (n, k); columns that are not numbers are left out.
        link: The frame counter's word, where the bag has one.

    """
    jumps = np.diff(index) - 1
    return Stamps(
        received=len(index),
        missing=int(jumps.sum()),
        gaps=int((jumps > 0).sum()),
        longest_s=float(jumps.max(initial=0)) * period_s,
        repeated=_repeated(values[:, np.isfinite(values).all(axis=0)]),
        link=link,
    )


def _repeated(values: FloatArray) -> int:
    """Neighbours equal in all channels, where chance (each channel's own share of equal neighbours) makes few."""
    moving = values[:, np.ptp(values, axis=0) > 0]
    if moving.shape[1] < 3:
        return 0
    equal = np.diff(moving, axis=0) == 0.0
    together = int(equal.all(axis=1).sum())
    chance = len(equal) * float(np.prod(equal.mean(axis=0)))
    return together if together > BY_CHANCE * max(chance, 1.0) else 0
