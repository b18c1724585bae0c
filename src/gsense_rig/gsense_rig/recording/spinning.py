"""An executor with a thread of its own, for nodes that come and go."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable
from typing import Any

from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor


def make_executor(context: Any = None) -> Any:
    """The events executor costs a fraction of the others; not every Jazzy has it."""
    try:
        from rclpy.experimental import EventsExecutor  # noqa: PLC0415
    except ImportError:
        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)


class Spinner:
    """Serves nodes until it is closed."""

    def __init__(self, context: Any) -> None:
        self._executor = make_executor(context)
        self._ended = threading.Event()
        self._tasks: queue.SimpleQueue[tuple[Callable[[Any], Any], Any, threading.Event]] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._spin, name="executor", daemon=True)
        self._thread.start()

    def add(self, node: Any) -> None:
        """Serves a node from now on."""
        self._do(self._executor.add_node, node)

    def remove(self, node: Any) -> None:
        """Serves it no more; no callback of it runs when this returns."""
        self._do(self._executor.remove_node, node)

    @property
    def alive(self) -> bool:
        """Whether nodes are served; a callback that raised has ended it."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Ends the thread."""
        self._ended.set()
        self._thread.join(5.0)

    def _do(self, action: Callable[[Any], Any], node: Any) -> None:
        """In the executor's own thread, between two callbacks."""
        done = threading.Event()
        self._tasks.put((action, node, done))
        done.wait(5.0)

    def _spin(self) -> None:
        with contextlib.suppress(ExternalShutdownException):
            while not self._ended.is_set():
                while not self._tasks.empty():
                    action, node, done = self._tasks.get()
                    action(node)
                    done.set()
                self._executor.spin_once(timeout_sec=0.05)
