"""The parent's side of the loop process: starts it, sends commands, hands out what comes back."""

from __future__ import annotations

import contextlib
import itertools
import os
import subprocess
import sys
import threading
from concurrent.futures import Future
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gsense_rig.hardware.interface import HardwareError
from gsense_rig.loop.messages import Reply, Result, Telemetry
from gsense_rig.loop.pacing import LoopHealth
from gsense_rig.loop.spec import Mount, ProcessSpec, Shutdown, SignOfLife, StartFailure
from gsense_rig.loop.wire import FrameReader, FrameWriter, PipeClosed

if TYPE_CHECKING:
    from collections.abc import Callable

    from gsense_rig.loop.messages import Command

_SIGN_OF_LIFE = 0.05  # s, and at least four times within the loop's patience


class LoopGone(RuntimeError):  # noqa: N818 - what happened, not whose error
    """The loop process ended."""


class LoopProcess:
    """Starts the loop process; `on_telemetry` and `on_health` are called in the receiving thread.

    Args:
        spec: what to run.
        on_telemetry: called for every telemetry message, in order.
        on_health: called once a second.
        on_end: called once when the process ends unasked.

    Attributes:
        telemetry: the newest, None before the first.
    """

    def __init__(
        self,
        spec: ProcessSpec,
        on_telemetry: Callable[[Telemetry], None],
        on_health: Callable[[LoopHealth], None] | None = None,
        on_end: Callable[[], None] | None = None,
    ) -> None:
        self._on_telemetry = on_telemetry
        self._on_health = on_health
        self._on_end = on_end
        self._ids = itertools.count(1)
        self._replies: dict[int, Future[Reply]] = {}
        self._results: dict[int, Future[Result]] = {}
        self._lock = threading.Lock()
        patience = spec.parameters.safety.command_timeout
        self._interval = _SIGN_OF_LIFE if patience is None else min(_SIGN_OF_LIFE, patience / 4.0)
        self._closing = threading.Event()
        self._first: Future[None] = Future()
        self.telemetry: Telemetry | None = None
        self._launch()
        self._send(spec)
        self._receiver = threading.Thread(target=self._receive, name="loop telemetry", daemon=True)
        self._alive = threading.Thread(target=self._live, name="loop sign of life", daemon=True)
        self._receiver.start()
        self._alive.start()

    @property
    def pid(self) -> int:
        """Process id of the loop."""
        return self._process.pid

    def wait_ready(self, timeout: float = 60.0) -> None:
        """Wait for the first telemetry.

        Raises:
            HardwareError: the loop could not start; the message says why.
            TimeoutError: it did not start in time.
        """
        self._first.result(timeout)

    def next_id(self) -> int:
        """Id for a new command."""
        return next(self._ids)

    def request(self, command: Command) -> tuple[Future[Reply], Future[Result]]:
        """Send a command; its reply and (where accepted) its result arrive in the futures."""
        reply: Future[Reply] = Future()
        result: Future[Result] = Future()
        with self._lock:
            self._replies[command.id] = reply
            self._results[command.id] = result
        try:
            self._send(command)
        except PipeClosed:
            self._fail_all()
        return reply, result

    def mount(self, name: str) -> None:
        """Turn the simulated board; names as in a plan, at rest only.

        Raises:
            LoopGone: the loop process has ended.
        """
        try:
            self._send(Mount(name))
        except PipeClosed:
            raise LoopGone("the loop process is gone") from None

    def close(self, timeout: float = 5.0) -> int:
        """Stop the motor softly and end the process; return its exit code."""
        self._closing.set()
        with contextlib.suppress(PipeClosed):
            self._send(Shutdown())
        try:
            code = self._process.wait(timeout)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        self._receiver.join(1.0)
        self._alive.join(1.0)
        return code

    def _launch(self) -> None:
        command_read, command_write = os.pipe()
        telemetry_read, telemetry_write = os.pipe()
        package_root = str(Path(__file__).resolve().parents[2])
        path = os.pathsep.join(filter(None, [package_root, os.environ.get("PYTHONPATH", "")]))
        self._process = subprocess.Popen(
            [sys.executable, "-m", "gsense_rig.loop", str(command_read), str(telemetry_write)],
            pass_fds=(command_read, telemetry_write),
            env={**os.environ, "PYTHONPATH": path},
        )
        os.close(command_read)
        os.close(telemetry_write)
        self._commands = FrameWriter(command_write)
        self._telemetry = FrameReader(telemetry_read, blocking=True)

    def _send(self, item: object) -> None:
        with self._lock:
            self._commands.send(item)

    def _live(self) -> None:
        while not self._closing.wait(self._interval):
            try:
                self._send(SignOfLife())
            except PipeClosed:
                return

    def _receive(self) -> None:
        try:
            while True:
                for item in self._telemetry.receive():
                    self._dispatch(item)
        except PipeClosed:
            pass
        self._fail_all()
        if not self._first.done():
            self._first.set_exception(HardwareError("the loop process ended before it ran"))
        if not self._closing.is_set() and self._on_end is not None:
            self._on_end()

    def _dispatch(self, item: Any) -> None:
        if isinstance(item, Telemetry):
            self.telemetry = item
            if not self._first.done():
                self._first.set_result(None)
            self._on_telemetry(item)
        elif isinstance(item, Reply):
            self._resolve(self._replies, item)
            if not item.accepted:
                with self._lock:
                    self._results.pop(item.id, None)
        elif isinstance(item, Result):
            self._resolve(self._results, item)
        elif isinstance(item, LoopHealth):
            if self._on_health is not None:
                self._on_health(item)
        elif isinstance(item, StartFailure):
            self._first.set_exception(HardwareError(item.message))

    def _resolve(self, waiting: dict[int, Future[Any]], item: Reply | Result) -> None:
        with self._lock:
            future = waiting.pop(item.id, None)
        if future is not None:
            future.set_result(item)

    def _fail_all(self) -> None:
        with self._lock:
            futures: list[Future[Any]] = [*self._replies.values(), *self._results.values()]
            self._replies, self._results = {}, {}
        for future in futures:
            if not future.done():
                future.set_exception(LoopGone("the loop process is gone"))
