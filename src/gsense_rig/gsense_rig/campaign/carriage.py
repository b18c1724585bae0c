"""The carriage of a simulated campaign: the live rig's own loop and controller on a virtual clock."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gsense_rig.campaign.plan import PlanRun
from gsense_rig.hardware.sim import SimRail
from gsense_rig.loop.messages import Command, DriveMove, DriveSine, Home, Shape, Telemetry
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.rig_loop import RigLoop
from gsense_rig.loop.simulated import VirtualClock

Array = npt.NDArray[np.float64]
POSE_RATE = 200.0
STATE_RATE = 50.0
STILL_BEFORE = 2.0
"""s of rest in the bag before a motion."""
STILL_AFTER = 1.0
"""s of rest in the bag after it."""


class CarriageError(RuntimeError):
    """The simulated rig did not do what the plan asks; the message is one line."""


@dataclass(frozen=True)
class CarriageRecord:
    """What happened in a stretch of time; times in s of the session."""

    history: Array
    """(n, 5) at 1 kHz: t, position, velocity, acceleration, motor current: the truth."""
    poses: tuple[Telemetry, ...]
    """What the loop knew at 200 Hz; its times are the loop's: add `offset`."""
    states: tuple[Telemetry, ...]
    """The same at 50 Hz."""
    offset: float
    """s: the session's time minus the loop's."""


class Carriage:
    """Makes the motions of a plan, one after the other. The loop's clock stands still while nobody uses the rig."""

    def __init__(self, seed: int, parameters: LoopParameters | None = None) -> None:
        parameters = parameters or LoopParameters(tuned=True)
        hardware = SimRail(parameters.plant, seed)
        self._loop = RigLoop(hardware, parameters)
        self._clock = VirtualClock(self._loop, hardware, self._note)
        self._per_pose = round(parameters.rate / POSE_RATE)
        self._per_state = round(parameters.rate / STATE_RATE)
        self._ticks = 0
        self._commands = 0
        self._offset = 0.0
        self._reset_record()

    @property
    def now(self) -> float:
        """Seconds of the session."""
        return self._clock.now + self._offset

    def home(self) -> CarriageRecord:
        """Finds the zero."""
        result = self._clock.run_command(Home(self._next_command()))
        if not result.success:
            raise CarriageError(f"homing the simulated rig failed: {result.message}")
        return self._take_record()

    def rest(self, seconds: float) -> CarriageRecord:
        """Time passes while nobody uses the rig and the motor is off; no telemetry."""
        steps = round(seconds * 1e3)
        first = math.floor(self._clock.now * 1e3 + 1e-6) + 1
        history = np.zeros((steps, 5))
        history[:, 0] = (first + np.arange(steps)) * 1e-3 + self._offset
        history[:, 1] = self._clock.hardware.plant.position
        record = CarriageRecord(history, (), (), self._offset)
        self._offset += steps * 1e-3
        return record

    def prepare(self, run: PlanRun) -> CarriageRecord:
        """Brings the carriage to where the run begins."""
        start = -run.amplitude if run.shape == "triangle" else run.position
        if abs(self._clock.telemetry.position - start) > 1e-3:
            self._run(DriveMove(self._next_command(), Shape.HOLD, start))
        return self._take_record()

    def perform(self, run: PlanRun) -> CarriageRecord:
        """The run: rest, motion, rest; a static run is rest alone."""
        self._reset_record()
        if run.shape == "static":
            self._clock.run_for(run.duration)
        else:
            self._clock.run_for(STILL_BEFORE)
            self._run(command_of(run, self._next_command()))
            self._clock.run_for(STILL_AFTER)
        return self._take_record()

    def _run(self, command: Command) -> None:
        try:
            result = self._clock.run_command(command)
        except RuntimeError as error:
            raise CarriageError(f"the simulated rig: {error}") from error
        if not result.success:
            raise CarriageError(f"the simulated rig stopped: {result.message}")

    def _note(self, telemetry: Telemetry, history: Array) -> None:
        self._history.append(history)
        if self._ticks % self._per_pose == 0:
            self._poses.append(telemetry)
        if self._ticks % self._per_state == 0:
            self._states.append(telemetry)
        self._ticks += 1

    def _next_command(self) -> int:
        self._commands += 1
        return self._commands

    def _reset_record(self) -> None:
        self._history: list[Array] = []
        self._poses: list[Telemetry] = []
        self._states: list[Telemetry] = []

    def _take_record(self) -> CarriageRecord:
        history = np.concatenate(self._history) if self._history else np.zeros((0, 5))
        history[:, 0] += self._offset
        record = CarriageRecord(history, tuple(self._poses), tuple(self._states), self._offset)
        self._reset_record()
        return record


def command_of(run: PlanRun, command: int) -> DriveSine | DriveMove:
    """The command of a run's motion; at least `duration` of whole cycles at full amplitude."""
    if run.shape == "triangle":
        return DriveMove(command, Shape.TRIANGLE, 0.0, run.amplitude, run.angular_frequency, run.duration)
    cycles = max(1, math.ceil(run.duration * run.angular_frequency / (2.0 * math.pi) - 1e-9))
    return DriveSine(command, run.amplitude, run.angular_frequency, cycles)
