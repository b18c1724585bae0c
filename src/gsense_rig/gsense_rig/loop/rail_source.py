"""What is behind the loop process: the simulated rail, whose physics must be advanced, or a card, whose is its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gsense_rig.hardware.sim_shared import SharedRailSpec, share
from gsense_rig.loop.guard_link import GuardLink
from gsense_rig.loop.guard_process import urgent
from gsense_rig.loop.rig_loop import RigLoop
from gsense_rig.loop.simulated import make_simulated_loop

if TYPE_CHECKING:
    from gsense_rig.hardware.interface import RailHardware
    from gsense_rig.hardware.sim import SimRail
    from gsense_rig.loop.spec import ProcessSpec, SensorFeed

SIMULATED_SILENCE = 2.0  # s that a guard of the simulated rail may be held up; its time stands still with the loop's
CARD_PATIENCE = 1.3  # of the guard's own patience with the loop
_PRIORITY = 50  # of SCHED_FIFO


class SimulatedSource:
    """The simulated rail; late ticks are caught up, so that its time has no hole."""

    catch_up = True

    def __init__(self, spec: ProcessSpec) -> None:
        self._spec = spec
        self._feed: SensorFeed | None = spec.feed_factory() if spec.feed_factory is not None else None
        fd, self._memory = share(spec.memory)
        guarded = SharedRailSpec(fd, spec.seed, spec.parameters.plant)
        self.guard = GuardLink(guarded, spec.parameters.model, spec.guard, SIMULATED_SILENCE)
        self._rail: SimRail | None = None

    def open(self, start: float) -> tuple[RigLoop, RailHardware]:
        """Make loop and rail, both at a time [s]."""
        spec = self._spec
        loop, self._rail = make_simulated_loop(spec.parameters, spec.seed, spec.position, start, self._memory)
        return loop, self._rail

    def advance(self, due: float) -> None:
        """Let the physics run to a tick's time [s]."""
        if self._rail is not None:
            history = self._rail.advance(due)
            if self._feed is not None:
                self._feed.advance(history)

    def mount(self, name: str) -> None:
        """Turn the simulated board."""
        if self._feed is not None:
            self._feed.mount(name)

    def close(self) -> None:
        """End the sensor feed."""
        if self._feed is not None:
            self._feed.close()


class CardSource:
    """A real card; a late tick is skipped, because the past cannot be controlled."""

    catch_up = False

    def __init__(self, spec: ProcessSpec) -> None:
        if spec.card is None:
            raise ValueError("no card in the process's specification")
        self._spec, self._card = spec, spec.card
        self.guard = GuardLink(spec.card, spec.parameters.model, spec.guard, CARD_PATIENCE * spec.guard.timeout)

    def open(self, start: float) -> tuple[RigLoop, RailHardware]:  # noqa: ARG002 - the simulation's needs it
        """Open the card and make the loop."""
        hardware = self._card.open()
        urgent(_PRIORITY)
        return RigLoop(hardware, self._spec.parameters), hardware

    def advance(self, due: float) -> None:
        """Nothing: time passes by itself."""

    def mount(self, name: str) -> None:
        """Nothing: a person turns the board."""

    def close(self) -> None:
        """Nothing beside the hardware."""


def make_source(spec: ProcessSpec) -> SimulatedSource | CardSource:
    """Make what the specification asks for.

    Raises:
        HardwareError, ValueError: it cannot be had; the message is one line.
    """
    return SimulatedSource(spec) if spec.card is None else CardSource(spec)
