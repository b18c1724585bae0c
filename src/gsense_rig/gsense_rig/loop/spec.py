"""What parent and loop process tell each other about starting and ending. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol

from gsense_rig.loop.guard_link import GuardedRailSpec
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.safety.guard import GuardLimits

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from gsense_rig.hardware.interface import RailHardware


class CardSpec(GuardedRailSpec, Protocol):
    """How loop and guard open the real rail's card; picklable."""

    def open(self) -> RailHardware:
        """Open it for the loop, motor disabled.

        Raises:
            HardwareError: the card is missing or failed; the message is one line.
        """


class SensorFeed(Protocol):
    """What takes the carriage's motion (the simulated board)."""

    def advance(self, history: NDArray[np.float64]) -> None:
        """Take an array with shape (n, 5): time [s], position, velocity, acceleration, motor current; 1 ms rows."""

    def mount(self, name: str) -> None:
        """Turn the board on the carriage; names as in a plan."""

    def close(self) -> None:
        """End."""


@dataclass(frozen=True)
class ProcessSpec:
    """What the process needs to start; picklable."""

    parameters: LoopParameters = field(default_factory=LoopParameters)
    seed: int = 0
    position: float | None = None  # m, start position of the simulated carriage; None: drawn
    telemetry_every: int = 3  # ticks
    guard: GuardLimits = field(default_factory=GuardLimits)
    card: CardSpec | None = None  # the real rail's card; None: the simulated rail
    memory: Path | None = None  # file for the simulated rail's memory, to be looked at afterwards; None: anonymous
    feed_factory: Callable[[], SensorFeed] | None = None  # a module's function, or a functools.partial of one


class SignOfLife(NamedTuple):
    """The command source is alive."""


class Mount(NamedTuple):
    """Turn the simulated board on the carriage."""

    name: str


class Shutdown(NamedTuple):
    """Stop softly and end."""


class StartFailure(NamedTuple):
    """The process could not start."""

    message: str
