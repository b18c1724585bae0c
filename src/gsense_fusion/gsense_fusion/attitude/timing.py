"""Time steps from header stamps: never from a fixed rate, never backwards."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from gsense_fusion.compiling import kernel

from .interface import FloatArray, IntArray

BoolArray = NDArray[np.bool_]

_GAP = 1.6
"""An interval this many times the usual one lacks a sample."""
_NEW_RHYTHM = 3
"""So many intervals in a row that are far from the usual one are the usual ones from then on."""


class StepKind(Enum):
    """What to do with a sample."""

    FIRST = "first"
    NEXT = "next"
    DROP = "drop"
    """Not younger than the one before: out of order, or repeated."""
    RESET = "reset"
    """The clock jumped back (a bag from its start again, a restarted source): begin anew with this sample."""


@dataclass
class TimingCounts:
    """Since the start of the node."""

    samples: int = 0
    """Samples used."""
    gaps: int = 0
    """Intervals that lack samples."""
    missing: int = 0
    """Samples that these lack, from their lengths."""
    out_of_order: int = 0
    """Samples dropped for a stamp before the newest one's."""
    repeated: int = 0
    """Samples dropped for the stamp of the newest one."""
    resets: int = 0


class StepTimer:
    """Stamps in, intervals out."""

    def __init__(self, longest_s: float = 0.1, reset_back_s: float = 1.0) -> None:
        """A timer.

        Args:
            longest_s: longer intervals are cut to this: over a gap the rate is unknown, and extrapolating it turns the
                attitude away faster than gravity brings it back.
            reset_back_s: a stamp this much before the newest one is a new start, not a late sample.
        """
        self.longest_s = longest_s
        self.reset_back_ns = round(reset_back_s * 1e9)
        self.counts = TimingCounts()
        self._rhythm = np.zeros(2)
        """Usual interval (s, 0: not known), followed slowly; so many in a row were far longer (+) or shorter (-)."""
        self._newest_ns: int | None = None

    @property
    def usual_s(self) -> float | None:
        """Usual interval, s; None before the second sample."""
        return float(self._rhythm[0]) or None

    def step(self, stamp_ns: int) -> tuple[StepKind, float]:
        """What the sample of this stamp is, and its interval to the one before in s (0 but for NEXT)."""
        newest = self._newest_ns
        if newest is not None and stamp_ns <= newest:
            if newest - stamp_ns < self.reset_back_ns:
                if stamp_ns == newest:
                    self.counts.repeated += 1
                else:
                    self.counts.out_of_order += 1
                return StepKind.DROP, 0.0
            self.counts.resets += 1
            self._newest_ns = stamp_ns
            self.counts.samples += 1
            return StepKind.RESET, 0.0
        self._newest_ns = stamp_ns
        self.counts.samples += 1
        if newest is None:
            return StepKind.FIRST, 0.0
        interval = (stamp_ns - newest) * 1e-9
        missing = _follow(interval, self._rhythm)
        self.counts.gaps += missing > 0
        self.counts.missing += missing
        return StepKind.NEXT, min(interval, self.longest_s)

    def batch(self, stamp_ns: IntArray) -> tuple[BoolArray, FloatArray, int]:
        """`step` over many stamps, up to the first that is a RESET (which is not taken).

        Returns:
            Which of the taken samples are used, their intervals (s, 0 where not used), and how many were taken.
        """
        if self._newest_ns is None or self.usual_s is None:
            raise ValueError("StepTimer.batch goes on after two single steps")
        c = self.counts
        counts = np.array([c.samples, c.gaps, c.missing, c.out_of_order, c.repeated], dtype=np.int64)
        stamps = np.ascontiguousarray(stamp_ns, dtype=np.int64)
        used, dt, taken, self._newest_ns = _steps(
            stamps, self._newest_ns, self.reset_back_ns, self.longest_s, self._rhythm, counts
        )
        c.samples, c.gaps, c.missing, c.out_of_order, c.repeated = (int(value) for value in counts)
        return used[:taken], dt[:taken], taken


@kernel("i8(f8, f8[::1])")
def _follow(interval, rhythm):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Samples that an interval lacks; the usual one is followed.

    A single pair of close stamps, or a gap, is no new rhythm: some in a row are.
    """
    usual = rhythm[0]
    if usual == 0.0:
        rhythm[0] = interval
        return 0
    if 0.5 * usual <= interval <= _GAP * usual:
        rhythm[0], rhythm[1] = usual + 0.02 * (interval - usual), 0.0
        return 0
    longer = interval > usual
    rhythm[1] = max(rhythm[1], 0.0) + 1.0 if longer else min(rhythm[1], 0.0) - 1.0
    if abs(rhythm[1]) >= _NEW_RHYTHM:
        rhythm[0], rhythm[1] = interval, 0.0
        return 0
    return round(interval / usual) - 1 if longer else 0


@kernel("Tuple((b1[::1], f8[::1], i8, i8))(i8[::1], i8, i8, f8, f8[::1], i8[::1])")
def _steps(stamps, newest, reset_back, longest, rhythm, counts):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    n = stamps.shape[0]
    used, dt = np.zeros(n, dtype=np.bool_), np.zeros(n)
    for i in range(n):
        stamp = stamps[i]
        if stamp <= newest:
            if newest - stamp >= reset_back:
                return used, dt, i, newest
            counts[4 if stamp == newest else 3] += 1
            continue
        interval = (stamp - newest) * 1e-9
        newest = stamp
        counts[0] += 1
        used[i], dt[i] = True, min(interval, longest)
        missing = _follow(interval, rhythm)
        counts[1] += missing > 0
        counts[2] += missing
    return used, dt, n, newest
