"""The processes of a demonstration: finds executables as `ros2 run` does, starts them, notices their death, ends them.

Every process leads a session of its own: Ctrl-C in the terminal reaches the demo alone, which ends them in order.
Should the demo itself be killed, the kernel sends them SIGTERM (PR_SET_PDEATHSIG).
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

_PR_SET_PDEATHSIG = 1
_LIBC = ctypes.CDLL(None, use_errno=True)
_POLITE, _FIRM = 6.0, 3.0
"""s from SIGINT to SIGTERM, and from there to SIGKILL."""


class DemoError(RuntimeError):
    """The demonstration cannot go on; the message is one line."""


@dataclass
class Child:
    """One process that was started."""

    name: str
    process: subprocess.Popen[str]
    log: Path

    @property
    def running(self) -> bool:
        """Whether it has not ended."""
        return self.process.poll() is None

    def last_words(self) -> str:
        """Last line of its log."""
        try:
            lines = self.log.read_text(encoding="utf-8", errors="replace").split("\n")
        except OSError:
            return ""
        return next((line.strip() for line in reversed(lines) if line.strip()), "")


def find_executable(package: str, name: str, environment: Mapping[str, str]) -> Path:
    """`lib/PACKAGE/NAME` under one of the prefixes in AMENT_PREFIX_PATH.

    Raises:
        DemoError: no prefix has it.
    """
    for prefix in environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        path = Path(prefix) / "lib" / package / name
        if prefix and os.access(path, os.X_OK):
            return path
    raise DemoError(
        f"no executable '{name}' of package '{package}' in AMENT_PREFIX_PATH; build and source the workspace"
    )


def ros_arguments(parameters: Mapping[str, str]) -> list[str]:
    """Parameters as a node's command line takes them."""
    return ["--ros-args", *(word for name, value in parameters.items() for word in ("-p", f"{name}:={value}"))]


class Processes:
    """All processes of a demonstration. Start them from the main thread: the kernel watches the thread that did."""

    def __init__(self, log: Path, environment: Mapping[str, str]) -> None:
        self._log = log
        self._environment = dict(environment)
        self._children: list[Child] = []

    def start(self, package: str, name: str, *arguments: str, label: str = "", pipe: bool = False) -> Child:
        """Starts an executable of a package.

        Args:
            package: its package.
            name: its name.
            arguments: its command line.
            label: how it is called, and its log; else `name`.
            pipe: stdout is read by the caller; else it goes into the log, where stderr always goes.

        Raises:
            DemoError: it does not exist or cannot be started.
        """
        path = find_executable(package, name, self._environment)
        label = label or name
        log = self._log / f"{label}.log"
        try:
            with log.open("a", encoding="utf-8") as stream:
                process = subprocess.Popen(
                    [str(path), *arguments],
                    env=self._environment,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.PIPE if pipe else stream,
                    stderr=stream,
                    text=True,
                    start_new_session=True,
                    preexec_fn=_dies_with(os.getpid()),  # noqa: PLW1509 - calls nothing that takes a lock
                )
        except OSError as error:
            raise DemoError(f"{label} cannot be started: {error.strerror or error}") from error
        child = Child(label, process, log)
        self._children.append(child)
        return child

    def check(self, *unless: Child) -> None:
        """Raises DemoError where a process has ended that should run; `unless` may end."""
        for child in self._children:
            if not child.running and child not in unless:
                raise DemoError(f"{child.name} ended {_how(child)}: {child.last_words()} ({child.log})")

    def wait(self, child: Child, meanwhile: Callable[[], None], timeout: float) -> int:
        """Waits for the end of a process that ends by itself; returns its exit code.

        Raises:
            DemoError: it takes too long, or another process died.
        """
        end = time.monotonic() + timeout
        while child.running:
            self.check(child)
            if time.monotonic() > end:
                raise DemoError(f"{child.name} is not done after {timeout:.0f} s: {child.last_words()} ({child.log})")
            meanwhile()
        self._children.remove(child)
        return child.process.returncode

    def stop(self, child: Child, timeout: float = 20.0) -> int:
        """Ends one process by SIGINT; returns its exit code.

        Raises:
            DemoError: it does not end.
        """
        child.process.send_signal(signal.SIGINT)
        try:
            code = child.process.wait(timeout)
        except subprocess.TimeoutExpired:
            raise DemoError(f"{child.name} does not end on SIGINT: {child.last_words()} ({child.log})") from None
        self._children.remove(child)
        return code

    def close(self) -> None:
        """Ends every process that is left: SIGINT, SIGTERM, at last SIGKILL to its whole group."""
        children, self._children = self._children, []
        for number, patience in ((signal.SIGINT, _POLITE), (signal.SIGTERM, _FIRM)):
            for child in children:
                if child.running:
                    child.process.send_signal(number)
            end = time.monotonic() + patience
            while any(child.running for child in children) and time.monotonic() < end:
                time.sleep(0.02)
        for child in children:
            with contextlib.suppress(ProcessLookupError):  # also what a process itself has left behind
                os.killpg(child.process.pid, signal.SIGKILL)
            child.process.wait()
            if child.process.stdout is not None:
                child.process.stdout.close()


def _how(child: Child) -> str:
    code = child.process.returncode
    return f"with exit code {code}" if code >= 0 else f"by {signal.Signals(-code).name}"


def _dies_with(parent: int) -> Callable[[], None]:
    def prepare() -> None:
        _LIBC.prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)
        if os.getppid() != parent:  # it went before the line above
            os._exit(1)

    return prepare
