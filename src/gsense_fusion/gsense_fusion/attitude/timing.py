"""Time steps from header stamps: never from a fixed rate, never backwards."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

_GAP = 1.6
"""An interval this many times the usual one lacks a sample."""


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
        self.usual_s: float | None = None
        """Usual interval, followed slowly."""
        self._newest_ns: int | None = None

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
        self._follow(interval)
        return StepKind.NEXT, min(interval, self.longest_s)

    def _follow(self, interval: float) -> None:
        usual = self.usual_s
        if usual is None or interval < 0.5 * usual:  # a first interval that was a gap is corrected by the next ones
            self.usual_s = interval
        elif interval > _GAP * usual:
            self.counts.gaps += 1
            self.counts.missing += round(interval / usual) - 1
        else:
            self.usual_s = usual + 0.02 * (interval - usual)
