"""The loop on a virtual clock, far faster than real time.

loop, hardware = make_simulated_loop(LoopParameters(), seed=1)
clock = VirtualClock(loop, hardware)
clock.run_command(Home(1))
for telemetry, history in clock.steps():   # forever, one item per tick
    ...
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from gsense_rig.hardware.sim import SimRail
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.rig_loop import RigLoop

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    from gsense_rig.hardware.sim_memory import RailMemory
    from gsense_rig.loop.messages import Command, Result, Telemetry


def make_simulated_loop(
    parameters: LoopParameters | None = None,
    seed: int = 0,
    position: float | None = None,
    time: float = 0.0,
    memory: RailMemory | None = None,
) -> tuple[RigLoop, SimRail]:
    """Make a loop on a simulated rail, both at a start time [s].

    Args:
        parameters: of loop and plant.
        seed: draws start position, encoder phase and sensor noise; the same seed repeats every number.
        position: start position [m] instead of a drawn one.
        time: the clock's start [s].
        memory: where the rail is kept; private where None.
    """
    parameters = parameters or LoopParameters()
    hardware = SimRail(parameters.plant, seed, position, time, memory)
    return RigLoop(hardware, parameters), hardware


class VirtualClock:
    """Ticks a simulated loop at its rate; tick k lies at start + k / rate, without drift.

    Attributes:
        now: time of the last tick [s].
        on_tick: called after every tick with its telemetry and the plant's history since the last tick, an array with
            shape (n, 5): time [s], position [m], velocity [m/s], acceleration [m/s²], motor current [A], one row per
            whole millisecond.
    """

    def __init__(
        self, loop: RigLoop, hardware: SimRail, on_tick: Callable[[Telemetry, NDArray[np.float64]], None] | None = None
    ) -> None:
        self.loop = loop
        self.hardware = hardware
        self.on_tick = on_tick
        self._start = hardware.plant.time
        self._ticks = 0
        self.now = self._start
        self.telemetry = loop.tick(self.now)

    def step(self) -> tuple[Telemetry, NDArray[np.float64]]:
        """Advance the plant by one period and tick the loop."""
        self._ticks += 1
        self.now = self._start + self._ticks / self.loop.parameters.rate
        history = self.hardware.advance(self.now)
        self.loop.sign_of_life(self.now)
        self.telemetry = self.loop.tick(self.now)
        if self.on_tick is not None:
            self.on_tick(self.telemetry, history)
        return self.telemetry, history

    def steps(self) -> Iterator[tuple[Telemetry, NDArray[np.float64]]]:
        """Tick forever."""
        while True:
            yield self.step()

    def run_for(self, seconds: float) -> None:
        """Tick for a time of the virtual clock."""
        for _ in range(math.ceil(seconds * self.loop.parameters.rate - 1e-9)):
            self.step()

    def run_command(self, command: Command, timeout: float = 3600.0) -> Result:
        """Submit a command and tick until it is done.

        Raises:
            RuntimeError: the command was refused, or was not done within the timeout [s].
        """
        reply = self.loop.submit(command)
        if not reply.accepted:
            raise RuntimeError(f"{type(command).__name__} refused: {reply.message}")
        end = self.now + timeout
        while True:
            for result in self.loop.take_results():
                if result.id == command.id:
                    return result
            if self.now >= end:
                raise RuntimeError(f"{type(command).__name__} was not done within {timeout:g} s")
            self.step()
