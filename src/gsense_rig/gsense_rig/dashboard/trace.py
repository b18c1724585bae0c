"""A rolling record at the page's rate: the mean of each 50 ms, for as long as a chart shows."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from itertools import count
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

STEP = 0.05  # s; 20 Hz
SPAN = 60.0  # s
LATE = 1.0  # s; stamps that go back further are of another clock

_generations = count(1)


@dataclass(frozen=True)
class Cursor:
    """How far a page has read a trace."""

    generation: int = 0
    bin: int = -1


@dataclass(frozen=True)
class Rows:
    """What is new to a page: bins [number, mean of each column]; a bin's time is its number times STEP."""

    afresh: bool
    """The page must forget what it has of this trace."""
    rows: list[list[float | int]]
    cursor: Cursor


class Trace:
    """Means over bins of message time; bins without a sample are left out, so that a chart shows the gap.

    Args:
        columns: values of a sample.
    """

    def __init__(self, columns: int) -> None:
        self._columns = columns
        self._clear()

    def _clear(self) -> None:
        self._generation = next(_generations)
        self._bins: deque[list[float | int]] = deque(maxlen=round(SPAN / STEP))
        self._bin: int | None = None
        self._sums = [0.0] * self._columns
        self._count = 0

    def add(self, stamp: float, values: Sequence[float]) -> None:
        """Take a sample.

        Args:
            stamp: its time, s. A little late: counts to the newest bin. Much earlier: a clock was set, all begins anew.
            values: one a column; a sample that is not finite is left out.
        """
        if not (math.isfinite(stamp) and all(map(math.isfinite, values))):
            return
        number = math.floor(stamp / STEP)
        if self._bin is not None and number < self._bin - round(LATE / STEP):
            self._clear()
        if self._bin is None:
            self._bin = number
        if number > self._bin:
            self._close(number)
        for column, value in enumerate(values):
            self._sums[column] += value
        self._count += 1

    def _close(self, following: int) -> None:
        if self._count and self._bin is not None:
            self._bins.append([self._bin, *(round(total / self._count, 6) for total in self._sums)])
        self._bin, self._sums, self._count = following, [0.0] * self._columns, 0

    def since(self, cursor: Cursor) -> Rows:
        """Complete bins that a page does not have yet."""
        afresh = cursor.generation != self._generation
        after = -1 if afresh else cursor.bin
        rows: list[list[float | int]] = []
        for row in reversed(self._bins):
            if not afresh and row[0] <= after:
                break
            rows.append(row)
        rows.reverse()
        newest = int(rows[-1][0]) if rows else after
        return Rows(afresh, rows, Cursor(self._generation, newest))
