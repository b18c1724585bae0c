"""A motion in work: references one after the other, and how well they were followed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gsense_rig.control.references import Hold, MoveTo, Setpoint, Sine

if TYPE_CHECKING:
    from gsense_rig.control.references import Reference


class Motion:
    """Follows references from a start time on.

    Args:
        command: id of the command it belongs to.
        segments: references, each beginning where the last one ended.
        start: loop time of the start [s].
    """

    def __init__(self, command: int, segments: list[Reference], start: float) -> None:
        self.command = command
        self.start = start
        self._segments = segments
        self._index = 0
        self._segment_start = start
        self._squares = 0.0
        self._count = 0

    @classmethod
    def sine(cls, command: int, sine: Sine, position: float, settle: float, start: float) -> Motion:
        """Move to the centre, drive the sine, settle."""
        return cls(command, [MoveTo(position, 0.0), Hold(0.0, settle), sine, Hold(0.0, settle)], start)

    def setpoint(self, now: float) -> Setpoint | None:
        """Setpoint at a time [s]; None when the motion is over."""
        while now - self._segment_start >= self._segments[self._index].duration:
            self._segment_start += self._segments[self._index].duration
            self._index += 1
            if self._index == len(self._segments):
                self._index -= 1
                return None
        return self._segments[self._index].at(now - self._segment_start)

    def note_error(self, now: float, error: float) -> None:
        """Take the tracking error [m] into the RMS where the sine is steady."""
        segment = self._segments[self._index]
        if isinstance(segment, Sine) and segment.is_steady(now - self._segment_start):
            self._squares += error * error
            self._count += 1

    @property
    def rms_error(self) -> float:
        """RMS of the tracking error over the steady part so far [m]."""
        return math.sqrt(self._squares / self._count) if self._count else 0.0
