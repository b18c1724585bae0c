"""The simulated rail in memory that loop and guard share, so that it outlives the loop.

While the loop process lives, it alone advances the physics. When it is dead, the guard's handle lets the physics go on
at the pace of its own looks: a motor that nobody watches any more would run on, and that is what the guard is for.
"""

from __future__ import annotations

import mmap
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from gsense_rig.hardware.interface import HardwareReading, MotorOutput
from gsense_rig.hardware.sim_memory import SIZE, RailMemory
from gsense_rig.plant.parameters import PlantParameters

if TYPE_CHECKING:
    from pathlib import Path

    from gsense_rig.hardware.sim import SimRail

_STEP = 0.002  # s that the physics goes on per look of the guard


def share(path: Path | None = None) -> tuple[int, RailMemory]:
    """Make shared memory for a rail: anonymous, or a file that can be looked at afterwards; file descriptor, memory."""
    flags = os.O_RDWR | os.O_CREAT | os.O_TRUNC
    fd = os.memfd_create("gsense-rail") if path is None else os.open(path, flags, 0o600)
    os.ftruncate(fd, SIZE)
    return fd, map_shared(fd)


def map_shared(fd: int) -> RailMemory:
    """Map what `share` made."""
    return RailMemory(memoryview(mmap.mmap(fd, SIZE)))


@dataclass(frozen=True)
class SharedRailSpec:
    """How the guard opens the simulated rail."""

    fd: int
    seed: int
    parameters: PlantParameters = field(default_factory=PlantParameters)

    def fds(self) -> tuple[int, ...]:
        """File descriptors that the guard inherits."""
        return (self.fd,)

    def open_guarded(self, owner: int) -> GuardedSimRail:
        """Open the guard's handle; owner: process id of the loop, which is the guard's parent."""
        return GuardedSimRail(self, owner)


class GuardedSimRail:
    """The guard's handle of the simulated rail."""

    def __init__(self, spec: SharedRailSpec, owner: int) -> None:
        self._spec = spec
        self._owner = owner
        self._memory = map_shared(spec.fd)
        self._orphan: SimRail | None = None
        self.counts_per_metre = spec.parameters.drive.counts_per_metre

    def now(self) -> float:
        """Time that the physics has reached [s]; goes on by one step where nobody else advances it."""
        if os.getppid() != self._owner:
            rail = self._adopt()
            rail.advance(self._memory.time + _STEP)
        return self._memory.time

    def read_counts(self) -> int:
        """Encoder."""
        return self._memory.counts(self.counts_per_metre)

    def read(self) -> HardwareReading:
        """Encoder and current; the guard asks for no switches."""
        return HardwareReading(self.read_counts(), (False, False, False, False), self._memory.current)

    def write(self, output: MotorOutput) -> None:
        """Set bridge and light."""
        self._memory.output = output

    def close(self) -> None:
        """Nothing to let go of."""

    def _adopt(self) -> SimRail:
        if self._orphan is None:
            from gsense_rig.hardware.sim import SimRail  # noqa: PLC0415 - its compiler takes a second and 100 MB

            self._orphan = SimRail.continued(self._spec.parameters, self._spec.seed, self._memory)
        return self._orphan
