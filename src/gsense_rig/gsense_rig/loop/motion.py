"""A motion in work: references one after the other, and how well they were followed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gsense_rig.control.references import Hold, MoveTo, Setpoint, Sine
from gsense_rig.control.triangle import Triangle
from gsense_rig.control.tuning import tune_segments
from gsense_rig.loop.messages import DriveMove, DriveSine, Park, Shape, Tune

if TYPE_CHECKING:
    from gsense_rig.control.limits import MotionLimits
    from gsense_rig.control.references import Reference
    from gsense_rig.loop.parameters import LoopParameters


class Motion:
    """Follows references from a start time on.

    Args:
        command: id of the command it belongs to.
        segments: references, each beginning where the last one ended.
        start: loop time of the start [s].
        scored: the segments whose tracking error counts; of a sine its steady part. None: sines alone.

    Attributes:
        record: where it is not None, the loop appends encoder position [m], duty since the last tick and motor current
            [A] in every period.
    """

    def __init__(
        self, command: int, segments: list[Reference], start: float, scored: tuple[int, ...] | None = None
    ) -> None:
        self.command = command
        self.start = start
        self.record: list[tuple[float, float, float]] | None = None
        self._segments = segments
        sines = tuple(k for k, segment in enumerate(segments) if isinstance(segment, Sine))
        self._scored = sines if scored is None else scored
        self._index = 0
        self._segment_start = start
        self._squares = 0.0
        self._count = 0

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return sum(segment.duration for segment in self._segments)

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
        """Take the tracking error [m] into the RMS where it counts."""
        if self._index not in self._scored:
            return
        segment = self._segments[self._index]
        if not isinstance(segment, Sine) or segment.is_steady(now - self._segment_start):
            self._squares += error * error
            self._count += 1

    @property
    def rms_error(self) -> float:
        """RMS of the tracking error over the part that counts, so far [m]."""
        return math.sqrt(self._squares / self._count) if self._count else 0.0


def motion_of(
    command: DriveSine | DriveMove | Park | Tune, position: float, now: float, parameters: LoopParameters
) -> Motion:
    """The motion of an admitted command from a position [m] and a time [s] on; it begins and ends at rest."""
    settle, limits = parameters.settle, parameters.motion
    if isinstance(command, DriveSine):
        sine = Sine(command.amplitude, command.angular_frequency, command.cycles)
        return Motion(command.id, [MoveTo(position, 0.0), Hold(0.0, settle), sine, Hold(0.0, settle)], now)
    if isinstance(command, Tune):
        motion = Motion(command.id, tune_segments(position, settle), now)
        motion.record = []
        return motion
    move = DriveMove(command.id, Shape.HOLD, limits.park) if isinstance(command, Park) else command
    segments = _move_segments(move, position, settle, limits)
    return Motion(command.id, segments, now, (0, 1) if move.shape == Shape.STEP else (1,))


def _move_segments(move: DriveMove, position: float, settle: float, limits: MotionLimits) -> list[Reference]:
    """The references of a move; the second one is the shape itself, a step's the hold after it."""
    target = move.position
    if move.shape == Shape.TRIANGLE:
        cycles = max(1, math.ceil(move.duration * move.angular_frequency / (2.0 * math.pi) - 1e-9))
        triangle = Triangle(move.amplitude, move.angular_frequency, cycles, target)
        rest = target - move.amplitude
        return [MoveTo(position, rest), triangle, Hold(rest, settle)]
    if move.shape == Shape.STEP:
        step = MoveTo(position, target, limits.step_velocity, limits.step_acceleration)
        return [step, Hold(target, move.duration + settle)]
    return [MoveTo(position, target), Hold(target, move.duration + settle)]
