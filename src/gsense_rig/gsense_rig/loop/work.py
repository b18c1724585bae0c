"""What the loop does for whom: at most one motion or homing at a time, and how commands ended."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gsense_rig.loop.messages import Result

if TYPE_CHECKING:
    from gsense_rig.loop.motion import Motion
    from gsense_rig.safety.homing import Homing


class Work:
    """The command in work and the results of those that ended.

    Attributes:
        motion: being followed, or None.
        homing: in progress, or None.
        begun: time at which the command's motion began [s].
    """

    def __init__(self) -> None:
        self.motion: Motion | None = None
        self.homing: Homing | None = None
        self.begun = 0.0
        self._homing_command = 0
        self._stop_command = 0
        self._results: list[Result] = []

    @property
    def command(self) -> int:
        """Id of the command in work; 0: none."""
        if self.motion is not None:
            return self.motion.command
        return self._homing_command if self.homing is not None else 0

    def begin_motion(self, motion: Motion, now: float) -> None:
        """Follow a motion."""
        self.motion, self.begun = motion, now

    def begin_homing(self, homing: Homing, command: int, now: float) -> None:
        """Home for a command."""
        self.homing, self._homing_command, self.begun = homing, command, now

    def begin_stop(self, command: int) -> None:
        """A stop takes the place of what is in work; an earlier stop that still lasts has succeeded."""
        if self._stop_command:
            self.finish(self._stop_command, True, "stopping, again")
            if self.motion is not None:
                self.motion.command = command
        elif self.motion is not None:
            self.finish(self.motion.command, False, "stopped", self.motion.rms_error)
        elif self.homing is not None:
            self.finish(self._homing_command, False, "stopped")
        self.homing, self._stop_command = None, command

    def end_motion(self, message: str) -> None:
        """The motion reached its end."""
        if self.motion is not None:
            record = None if self.motion.record is None else np.array(self.motion.record)
            self._results.append(Result(self.motion.command, True, message, self.motion.rms_error, record))
        self.motion = None

    def end_homing(self, message: str) -> None:
        """Homing found the zero."""
        self.finish(self._homing_command, True, message)
        self.homing = None

    def end_stop(self, message: str) -> None:
        """The stop ended at rest."""
        if self._stop_command:
            self.finish(self._stop_command, True, message)
        self.motion, self._stop_command = None, 0

    def fail(self, text: str) -> None:
        """A fault ends whatever is in work."""
        for command in {self.command, self._stop_command} - {0}:
            self.finish(command, False, text)
        self.motion, self.homing, self._stop_command = None, None, 0

    def finish(self, command: int, success: bool, message: str, rms_error: float = 0.0) -> None:
        """Note how a command ended."""
        self._results.append(Result(command, success, message, rms_error))

    def take_results(self) -> list[Result]:
        """Results since the last call."""
        results, self._results = self._results, []
        return results
