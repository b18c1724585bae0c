"""The page of memory that loop and guard share: heartbeat one way, stop and its acknowledgement the other."""

from __future__ import annotations

import mmap
import os

_BEAT, _GUARD_BEAT, _STOPS, _ACKNOWLEDGED, _CLOSING = range(5)
_SIZE = 4096


class WatchPage:
    """Five float64 words in an anonymous shared file; each is written by one side alone.

    Attributes:
        fd: to be inherited by the guard process.
    """

    def __init__(self, fd: int | None = None) -> None:
        self.fd = os.memfd_create("gsense-watch") if fd is None else fd
        if fd is None:
            os.ftruncate(self.fd, _SIZE)
        self._values = memoryview(mmap.mmap(self.fd, _SIZE)).cast("d")

    @property
    def beat(self) -> float:
        """Time of the loop's newest heartbeat [s] on the rail's clock; 0 before the first."""
        return float(self._values[_BEAT])

    @beat.setter
    def beat(self, now: float) -> None:
        self._values[_BEAT] = now

    @property
    def guard_beat(self) -> float:
        """Time at which the guard looked last [s], CLOCK_MONOTONIC; 0 before the first."""
        return float(self._values[_GUARD_BEAT])

    @guard_beat.setter
    def guard_beat(self, now: float) -> None:
        self._values[_GUARD_BEAT] = now

    @property
    def stops(self) -> int:
        """How often the guard stopped the motor."""
        return int(self._values[_STOPS])

    @stops.setter
    def stops(self, count: int) -> None:
        self._values[_STOPS] = count

    @property
    def acknowledged(self) -> int:
        """The number of stops that the loop knows of."""
        return int(self._values[_ACKNOWLEDGED])

    @acknowledged.setter
    def acknowledged(self, count: int) -> None:
        self._values[_ACKNOWLEDGED] = count

    @property
    def closing(self) -> bool:
        """Whether the loop has disabled the motor and needs no guard any more."""
        return self._values[_CLOSING] != 0.0

    @closing.setter
    def closing(self, closing: bool) -> None:
        self._values[_CLOSING] = float(closing)
