"""Absolute pacing of the loop, and how well it was kept."""

from __future__ import annotations

from typing import NamedTuple


class LoopHealth(NamedTuple):
    """Timing of the loop since the last report."""

    ticks: int  # since the start
    overruns: int  # ticks that began more than a period late, since the start
    mean_late: float  # s, over the report's interval
    p99_late: float  # s
    max_late: float  # s
    mean_cost: float  # s of computing per tick
    dropped: int  # telemetry messages that found no room


class Pacer:
    """Says when tick k is due: start + k / rate, so that errors never add up.

    Args:
        start: time of tick 0 [s].
        rate: ticks per second.
        catch_up: run late ticks one after the other at their due times (simulation: no hole in simulated time);
            otherwise skip to the present one (hardware: the past cannot be controlled).
    """

    def __init__(self, start: float, rate: float, catch_up: bool) -> None:
        self._start = start
        self._rate = rate
        self._catch_up = catch_up
        self._k = 0

    def next_due(self, now: float) -> float:
        """Due time of the next tick [s]."""
        self._k += 1
        if not self._catch_up:
            self._k = max(self._k, int((now - self._start) * self._rate))
        return self._start + self._k / self._rate


class LatenessMeter:
    """Collects how late ticks began and what they cost."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._late: list[float] = []
        self._cost = 0.0
        self._ticks = 0
        self._overruns = 0

    def note(self, late: float, cost: float) -> None:
        """Take one tick's lateness and computing time [s]."""
        self._late.append(late)
        self._cost += cost
        self._ticks += 1
        if late > self._period:
            self._overruns += 1

    def report(self, dropped: int = 0) -> LoopHealth:
        """Sum up and begin a new interval."""
        late = sorted(self._late) or [0.0]
        health = LoopHealth(
            self._ticks, self._overruns, sum(late) / len(late), late[min(len(late) - 1, int(0.99 * len(late)))],
            late[-1], self._cost / len(late), dropped,
        )  # fmt: skip
        self._late, self._cost = [], 0.0
        return health
