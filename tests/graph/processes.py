"""Starts the installed executables of the graph in the domain of the environment, and ends them whatever happens."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import subprocess
import time
from pathlib import Path


def executable(package: str, name: str) -> Path:
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        path = Path(prefix) / "lib" / package / name
        if prefix and os.access(path, os.X_OK):
            return path
    raise FileNotFoundError(f"{package} {name}: not installed; run by ./rig test")


def parameters(**values: object) -> list[str]:
    return ["--ros-args", *(word for name, value in values.items() for word in ("-p", f"{name}:={value}"))]


class Graph:
    """Processes with their logs in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
        self.processes: dict[str, subprocess.Popen[str]] = {}
        self.instead: dict[str, list[str]] = {}
        """By label, what is started in the place of the installed executable."""

    def start(self, label: str, package: str, name: str, *arguments: str) -> subprocess.Popen[str]:
        with (self.folder / f"{label}.log").open("w") as log:
            process = subprocess.Popen(
                [*self.instead.get(label, [str(executable(package, name))]), *arguments],
                env=self.environment,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
                start_new_session=True,
            )
        self.processes[label] = process
        return process

    def start_board(self, label: str, *arguments: str) -> Path:
        """The board; returns the path of its pseudo-terminal. A link: another board may get the same number later."""
        link = self.folder / f"{label}-tty"
        board = self.start(label, "gsense_driver", "board", "--link", str(link), *arguments)
        ready, _, _ = select.select([board.stdout], [], [], 60.0)
        assert ready, self.log(label)
        assert board.stdout is not None
        assert board.stdout.readline().strip() == os.path.realpath(link)
        return link

    def log(self, label: str) -> str:
        return (self.folder / f"{label}.log").read_text(errors="replace")

    def end(self, label: str, number: int = signal.SIGINT, timeout: float = 60.0) -> int:
        """Exit code after a signal."""
        process = self.processes.pop(label)
        try:
            process.send_signal(number)
            process.communicate(timeout=timeout)
        finally:
            self._kill(process)
        return process.returncode

    def check(self) -> None:
        dead = {k: self.log(k)[-500:] for k, p in self.processes.items() if p.poll() is not None}
        assert not dead

    def close(self) -> None:
        for process in self.processes.values():
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
        end = time.monotonic() + 30.0
        while any(p.poll() is None for p in self.processes.values()) and time.monotonic() < end:
            time.sleep(0.05)
        for process in self.processes.values():
            self._kill(process)
        self.processes.clear()

    @staticmethod
    def _kill(process: subprocess.Popen[str]) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        if process.stdout is not None:
            process.stdout.close()
