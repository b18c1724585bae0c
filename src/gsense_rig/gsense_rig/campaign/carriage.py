"""The carriage of a simulated campaign: the live rig's own loop and controller on a virtual clock."""

from __future__ import annotations

import math
from collections import deque
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


STATE_FIELDS = (
    *("mode", "light", "duty", "current", "reference", "tracking_error", "fault"),
    *(f"switches.{i}" for i in range(4)),
)
"""Fields of RigState."""
_LOOK = 3
"""Cycles of telemetry that must be still before a rest is skipped."""


class CarriageError(RuntimeError):
    """The simulated rig did not do what the plan asks; the message is one line."""


@dataclass(frozen=True)
class CarriageRecord:
    """What happened in a stretch of time; times in s of the session."""

    history: Array
    """(n, 5) at 1 kHz: t, position, velocity, acceleration, motor current: the truth."""
    poses: Array
    """(n, 4) at 200 Hz, what the loop knew: t, position, velocity, force."""
    states: Array
    """(n, 12) at 50 Hz: t, then `STATE_FIELDS`."""


class Carriage:
    """Makes the motions of a plan, one after the other.

    The loop's clock stands still while nobody uses the rig, and in the long part of a rest: with the motor off and the
    carriage still nothing changes but the sensors' noise, which is then drawn from the ticks just before.
    """

    def __init__(self, seed: int, parameters: LoopParameters | None = None) -> None:
        parameters = parameters or LoopParameters(tuned=True)
        hardware = SimRail(parameters.plant, seed)
        self._loop = RigLoop(hardware, parameters)
        self._clock = VirtualClock(self._loop, hardware, self._note)
        self._per_pose = round(parameters.rate / POSE_RATE)
        self._per_state = round(parameters.rate / STATE_RATE)
        self._cycle = math.lcm(self._per_pose, self._per_state)  # ticks; a whole number of ms
        self._recent: deque[tuple[Telemetry, Array]] = deque(maxlen=_LOOK * self._cycle)
        self._rng = np.random.default_rng([seed, 0x72657374])
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
        history = self._still_history(round(seconds * 1e3))
        self._offset += history.shape[0] * 1e-3
        return CarriageRecord(history, np.zeros((0, 4)), np.zeros((0, 1 + len(STATE_FIELDS))))

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
            self._idle(run.duration)
        else:
            self._idle(STILL_BEFORE)
            self._run(command_of(run, self._next_command()))
            self._idle(STILL_AFTER)
        return self._take_record()

    def _run(self, command: Command) -> None:
        try:
            result = self._clock.run_command(command)
        except RuntimeError as error:
            raise CarriageError(f"the simulated rig: {error}") from error
        if not result.success:
            raise CarriageError(f"the simulated rig stopped: {result.message}")

    def _idle(self, seconds: float) -> None:
        """The loop runs and nothing is commanded; most of it is skipped once the carriage is still."""
        rate = self._loop.parameters.rate
        left = math.ceil(seconds * rate - 1e-9)
        look = min(left, _LOOK * self._cycle)
        self._clock.run_for(look / rate)
        skip = (left - look) // self._cycle * self._cycle
        still = self._loop.at_rest and all(not history[:, 2:].any() for _, history in self._recent)
        if still and len(self._recent) == self._recent.maxlen:
            self._skip(skip)
        else:
            skip = 0
        self._clock.run_for((left - look - skip) / rate)

    def _skip(self, ticks: int) -> None:
        """That many periods of a still rig; whole cycles."""
        self._flush()
        time = self.now + np.arange(1, ticks + 1) / self._loop.parameters.rate
        index = self._ticks + np.arange(ticks)
        for every, rows, blocks in (
            (self._per_pose, _pose, self._pose_blocks),
            (self._per_state, _state, self._state_blocks),
        ):
            pool = np.array([rows(telemetry) for telemetry, _ in self._recent])
            due = time[index % every == 0]
            block = pool[self._rng.integers(pool.shape[0], size=due.shape[0])]
            block[:, 0] = due
            blocks.append(block)
        history = self._still_history(round(ticks / self._loop.parameters.rate * 1e3))
        self._history_blocks.append(history)
        self._offset += history.shape[0] * 1e-3
        self._ticks += ticks

    def _still_history(self, steps: int) -> Array:
        """The next milliseconds of a carriage that stands."""
        first = math.floor(self._clock.now * 1e3 + 1e-6) + 1
        history = np.zeros((steps, 5))
        history[:, 0] = (first + np.arange(steps)) * 1e-3 + self._offset
        history[:, 1] = self._clock.hardware.plant.position
        return history

    def _note(self, telemetry: Telemetry, history: Array) -> None:
        self._history.append(history)
        self._recent.append((telemetry, history))
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
        self._history_blocks = [np.zeros((0, 5))]
        self._pose_blocks = [np.zeros((0, 4))]
        self._state_blocks = [np.zeros((0, 1 + len(STATE_FIELDS)))]

    def _flush(self) -> None:
        """What was noted since the last change of the offset, in the session's time."""
        for rows, blocks in (
            (self._history, self._history_blocks),
            ([np.array([_pose(t) for t in self._poses]).reshape(-1, 4)], self._pose_blocks),
            ([np.array([_state(t) for t in self._states]).reshape(-1, 1 + len(STATE_FIELDS))], self._state_blocks),
        ):
            if rows:
                block = np.concatenate(rows)
                block[:, 0] += self._offset
                blocks.append(block)
        self._history, self._poses, self._states = [], [], []

    def _take_record(self) -> CarriageRecord:
        self._flush()
        record = CarriageRecord(
            np.concatenate(self._history_blocks),
            np.concatenate(self._pose_blocks),
            np.concatenate(self._state_blocks),
        )
        self._reset_record()
        return record


def _pose(t: Telemetry) -> tuple[float, ...]:
    return t.time, t.position, t.velocity, t.force


def _state(t: Telemetry) -> tuple[float, ...]:
    return (t.time, t.mode, t.light, t.duty, t.current, t.reference, t.tracking_error, t.fault, *t.switches)


def command_of(run: PlanRun, command: int) -> DriveSine | DriveMove:
    """The command of a run's motion; at least `duration` of whole cycles at full amplitude."""
    if run.shape == "triangle":
        return DriveMove(command, Shape.TRIANGLE, 0.0, run.amplitude, run.angular_frequency, run.duration)
    cycles = max(1, math.ceil(run.duration * run.angular_frequency / (2.0 * math.pi) - 1e-9))
    return DriveSine(command, run.amplitude, run.angular_frequency, cycles)
