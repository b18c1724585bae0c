"""The loop's side of the guard: starts it, beats, and notices when the guard is gone or has acted."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from gsense_rig.hardware.interface import HardwareError
from gsense_rig.loop.watch_page import WatchPage
from gsense_rig.plant.parameters import DriveParameters
from gsense_rig.safety.guard import GuardLimits

if TYPE_CHECKING:
    from gsense_rig.hardware.interface import GuardedRail

_READY_TIMEOUT = 30.0  # s for the guard's first look, on a busy machine
_LAST_WORDS = 2.0  # s for the guard to end when it is no longer needed


class GuardedRailSpec(Protocol):
    """How the guard opens its own handle of the rail; picklable."""

    def fds(self) -> tuple[int, ...]:
        """File descriptors that the guard inherits."""

    def open_guarded(self, owner: int) -> GuardedRail:
        """Open it in the guard process; owner: process id of the loop.

        Raises:
            HardwareError: the hardware is missing or failed.
        """


@dataclass(frozen=True)
class GuardSpec:
    """What the guard process needs to start."""

    rail: GuardedRailSpec
    owner: int
    page: int  # file descriptor of the watch page
    drive: DriveParameters = field(default_factory=DriveParameters)
    limits: GuardLimits = field(default_factory=GuardLimits)


class GuardLink:
    """One guard process at a time.

    Args:
        rail: what the guard opens.
        drive: the loop's belief about the drive.
        limits: of the guard.
        silence: s of CLOCK_MONOTONIC without a look of the guard after which it counts as gone.
    """

    def __init__(
        self, rail: GuardedRailSpec, drive: DriveParameters, limits: GuardLimits | None = None, silence: float = 0.1
    ) -> None:
        self._rail, self._drive, self._limits = rail, drive, limits or GuardLimits()
        self._silence = silence
        self._page = WatchPage()
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def pid(self) -> int:
        """Process id of the guard; 0: none."""
        return 0 if self._process is None else self._process.pid

    @property
    def gone(self) -> bool:
        """Whether there is no guard process."""
        return self._process is None or self._process.poll() is not None

    def start(self) -> None:
        """Start the guard process, or another one where it is gone; `wait_ready` ends when it looks."""
        self.end()
        self._page = WatchPage()
        os.set_inheritable(self._page.fd, True)
        package_root = str(Path(__file__).resolve().parents[2])
        path = os.pathsep.join(filter(None, [package_root, os.environ.get("PYTHONPATH", "")]))
        self._process = subprocess.Popen(
            [sys.executable, "-m", "gsense_rig.loop.guard_process"],
            stdin=subprocess.PIPE,
            pass_fds=(self._page.fd, *self._rail.fds()),
            env={**os.environ, "PYTHONPATH": path},
            start_new_session=True,  # Ctrl-C goes to the whole group; the guard outlives it
        )
        spec = GuardSpec(self._rail, os.getpid(), self._page.fd, self._drive, self._limits)
        if self._process.stdin is not None:
            self._process.stdin.write(pickle.dumps(spec))
            self._process.stdin.close()

    @property
    def ready(self) -> bool:
        """Whether the guard looks."""
        return self._page.guard_beat > 0.0

    def wait_ready(self) -> None:
        """Wait for the guard's first look.

        Raises:
            HardwareError: it did not start.
        """
        end = time.monotonic() + _READY_TIMEOUT
        while not self.ready:
            if self.gone or time.monotonic() > end:
                raise HardwareError("the guard process did not start; the motor stays off")
            time.sleep(0.002)

    def beat(self, now: float) -> None:
        """Tell the guard that the loop ran at a time [s] of the rail's clock."""
        self._page.beat = now

    def check(self) -> str | None:
        """Return what is wrong with the guard, or what it did; None where all is well."""
        if self.gone:
            return "the guard process is gone"
        if self._page.stops != self._page.acknowledged:
            self._page.acknowledged = self._page.stops
            return "the guard stopped the motor: the loop was silent"
        silent = time.monotonic() - self._page.guard_beat
        if self.ready and silent > self._silence:
            return f"the guard did not look for {silent:.2f} s"
        return None

    def end(self) -> None:
        """Let the guard go; the motor must be off."""
        if self._process is None:
            return
        self._page.closing = True
        try:
            self._process.wait(_LAST_WORDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process = None
        os.close(self._page.fd)
