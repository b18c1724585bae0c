"""The carriage of a simulated campaign: the live rig's own loop and controller on a virtual clock."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gsense_rig.campaign.plan import PlanRun
from gsense_rig.campaign.triangle import Triangle
from gsense_rig.control.references import Hold, MoveTo, Reference, Sine
from gsense_rig.hardware.sim import SimRail
from gsense_rig.loop.messages import Home, Telemetry
from gsense_rig.loop.motion import Motion
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.rig_loop import RigLoop
from gsense_rig.loop.simulated import VirtualClock
from gsense_rig.safety.modes import Mode

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
        parameters = parameters or LoopParameters()
        hardware = SimRail(parameters.plant, seed)
        self._loop = RigLoop(hardware, parameters)
        self._clock = VirtualClock(self._loop, hardware, self._note)
        self._per_pose = round(parameters.rate / POSE_RATE)
        self._per_state = round(parameters.rate / STATE_RATE)
        self._settle = parameters.settle
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
            self._follow([MoveTo(self._clock.telemetry.position, start), Hold(start, self._settle)])
        return self._take_record()

    def perform(self, run: PlanRun) -> CarriageRecord:
        """The run: rest, motion, rest; a static run is rest alone."""
        self._reset_record()
        if run.shape == "static":
            self._clock.run_for(run.duration)
        else:
            self._clock.run_for(STILL_BEFORE)
            self._follow(motion_of(run, self._clock.telemetry.position, self._settle))
            self._clock.run_for(STILL_AFTER)
        return self._take_record()

    def _follow(self, segments: Sequence[Reference]) -> None:
        command = self._next_command()
        machine = self._loop.machine
        if machine.mode is not Mode.IDLE:
            reason = machine.fault_text or "busy"
            raise CarriageError(f"the simulated rig is {machine.mode.name.lower()}, not idle: {reason}")
        self._loop.follow(Motion(command, list(segments), self._clock.now))
        limit = self._clock.now + 10.0 + sum(segment.duration for segment in segments)
        while self._clock.now < limit:
            self._clock.step()
            for result in self._loop.take_results():
                if result.id == command and not result.success:
                    raise CarriageError(f"the simulated rig stopped: {result.message}")
                if result.id == command:
                    return
        raise CarriageError("the simulated rig did not finish its motion")

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


def motion_of(run: PlanRun, position: float, settle: float) -> list[Reference]:
    """The references of a run's motion, from rest to rest; at least `duration` of whole cycles at full amplitude."""
    cycles = max(1, math.ceil(run.duration * run.angular_frequency / (2.0 * math.pi) - 1e-9))
    if run.shape == "triangle":
        triangle = Triangle(run.amplitude, run.angular_frequency, cycles)
        return [MoveTo(position, -run.amplitude), triangle, Hold(-run.amplitude, settle)]
    sine = Sine(run.amplitude, run.angular_frequency, cycles)
    return [MoveTo(position, 0.0), Hold(0.0, settle), sine, Hold(0.0, settle)]
