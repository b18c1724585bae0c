"""Rail, loop and guard on one virtual clock, with everything that a trial may break."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from gsense_rig.loop.messages import DriveSine, Home
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.simulated import make_simulated_loop
from gsense_rig.safety.guard import Guard
from gsense_rig.safety.modes import Fault, Mode
from gsense_rig.safety.monitor import SafetyLimits

if TYPE_CHECKING:
    from gsense_rig.hardware.interface import HardwareReading, MotorOutput
    from gsense_rig.hardware.sim import SimRail
    from gsense_rig.loop.messages import Command, Reply, Result

COMMAND_TIMEOUT = 0.015  # s, as for a card


def card_parameters(parameters: LoopParameters | None = None) -> LoopParameters:
    """The loop's parameters as they are with a card."""
    return replace(parameters or LoopParameters(), safety=SafetyLimits(command_timeout=COMMAND_TIMEOUT))


class _GuardedRail:
    """The guard's handle of a rail in the same process."""

    def __init__(self, rail: SimRail) -> None:
        self._rail = rail
        self.counts_per_metre = rail.counts_per_metre

    def now(self) -> float:
        return self._rail.plant.time

    def read_counts(self) -> int:
        return self._rail.read().counts

    def read(self) -> HardwareReading:
        return self._rail.read()

    def write(self, output: MotorOutput) -> None:
        self._rail.write(output)

    def close(self) -> None:
        """Nothing to let go of."""


class World:
    """Runs loop and guard at their own periods; event by event.

    Args:
        seed: draws the rail.
        parameters: of the loop.
        position: start [m]; drawn where None.

    Attributes:
        loop_alive, guard_alive, source_alive: set to False to kill one of them.
        loop_held_until: time [s] until which the loop does not run.
        farthest: largest distance from the middle so far [m].
        current: largest motor current so far [A].
        hit_speed: speed at which the carriage first met a buffer [m/s]; 0: never.
    """

    def __init__(self, seed: int = 0, parameters: LoopParameters | None = None, position: float | None = None) -> None:
        self.parameters = card_parameters(parameters)
        self.loop, self.rail = make_simulated_loop(self.parameters, seed, position)
        self.guard = Guard(_GuardedRail(self.rail), self.parameters.model)
        self.loop_alive = self.guard_alive = self.source_alive = True
        self.loop_held_until = 0.0
        self.farthest = self.current = self.hit_speed = 0.0
        self._ticks = self._looks = 0
        self._beat = 0.0
        self._acted = False
        track = self.rail.parameters.track
        self._buffer = track.end_stop - track.buffer_length
        self.telemetry = self.loop.tick(0.0)

    @property
    def now(self) -> float:
        """Time [s]."""
        return self.rail.plant.time

    @property
    def safe(self) -> bool:
        """Whether loop or guard has put the outputs into a stop."""
        return self.loop.machine.mode is Mode.FAULT or self.guard.report is not None

    @property
    def stopped(self) -> bool:
        """Whether the carriage stands and the motor is off."""
        return self.rail.output.disabled and self.rail.plant.velocity == 0.0

    def advance(self, until: float) -> None:
        """Let the physics run to a time [s] before the next event."""
        history = self.rail.advance(until)
        for row in history:
            self.farthest = max(self.farthest, abs(float(row[1])))
            self.current = max(self.current, abs(float(row[4])))
            if not self.hit_speed and abs(float(row[1])) >= self._buffer:
                self.hit_speed = abs(float(row[2]))

    @property
    def next_event(self) -> float:
        """When the loop ticks or the guard looks next [s]."""
        return min(self._events())

    def _events(self) -> tuple[float, float]:
        return (self._ticks + 1) / self.parameters.rate, (self._looks + 1) * self.guard.limits.period

    def step(self) -> None:
        """Go on to the next event: a tick of the loop or a look of the guard."""
        tick, look = self._events()
        self.advance(min(tick, look))
        if look <= tick:
            self._looks += 1
            self._look(look)
        if tick <= look:
            self._ticks += 1
            self._tick(tick)

    def run_for(self, seconds: float) -> None:
        """Go on for a time."""
        end = self.now + seconds
        while self.now < end - 1e-9:
            self.step()

    def submit(self, command: Command) -> Reply:
        """Give the loop a command."""
        return self.loop.submit(command)

    def home(self) -> None:
        """Find the zero.

        Raises:
            RuntimeError: the rig refused or failed.
        """
        self._accept(Home(1))
        results: list[Result] = []
        while not results:
            self.step()
            results = self.loop.take_results()
        if not results[0].success:
            raise RuntimeError(results[0].message)

    def start_sine(self, amplitude: float = 0.15, angular_frequency: float = 8.0) -> None:
        """Begin a long sine.

        Raises:
            RuntimeError: the rig refused.
        """
        self._accept(DriveSine(2, amplitude, angular_frequency, 1000))

    def _accept(self, command: Command) -> None:
        reply = self.submit(command)
        if not reply.accepted:
            raise RuntimeError(reply.message)

    def drive(self, phase: float, amplitude: float = 0.15, angular_frequency: float = 8.0) -> None:
        """Home, drive a sine and go on to a phase of it [rad] at full amplitude.

        Raises:
            RuntimeError: the rig refused, or stopped itself.
        """
        self.home()
        self.start_sine(amplitude, angular_frequency)
        period = 2.0 * math.pi / angular_frequency
        self.run_for(1.0 + 1.5 * period)
        last, end = self._phase(angular_frequency, phase), self.now + 2.0 * period
        while self.now < end:
            self.step()
            here = self._phase(angular_frequency, phase)
            if last > 1.5 * math.pi and here < 0.5 * math.pi:
                return
            last = here
        raise RuntimeError(f"the sine does not run: {self.loop.machine.fault_text or 'no such phase'}")

    def _phase(self, angular_frequency: float, phase: float) -> float:
        x, v = self.telemetry.position, self.telemetry.velocity / angular_frequency
        return (math.atan2(x, v) - phase) % (2.0 * math.pi)

    def _look(self, now: float) -> None:
        if self.guard_alive:
            self.guard.tick(now, self._beat)
            self._acted = self._acted or self.guard.report is not None

    def _tick(self, now: float) -> None:
        if not self.loop_alive or now < self.loop_held_until:
            return
        if self.source_alive:
            self.loop.sign_of_life(now)
        if not self.guard_alive:
            self.loop.abort(Fault.GUARD, "the guard process is gone")
        if self._acted:
            self.loop.abort(Fault.GUARD, "the guard stopped the motor: the loop was silent")
            self.guard.rearm()
            self._acted = False
        self.telemetry = self.loop.tick(now)
        self._beat = now
