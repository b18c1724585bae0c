"""Hears the graph: raw messages of every topic, in a thread, with little work for each."""

from __future__ import annotations

import contextlib
import struct
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.signals import SignalHandlerOptions


def stamp_ns(raw: bytes) -> int:
    """Header stamp of a serialized message."""
    seconds, nanoseconds = struct.unpack_from("<iI" if raw[1] & 1 else ">iI", raw, 4)
    return seconds * 1_000_000_000 + nanoseconds


class Ears:
    def __init__(self, topics: dict[str, Any]) -> None:
        self.types = topics
        self.heard: dict[str, list[bytes]] = {name: [] for name in topics}
        self.context = Context()
        rclpy.init(context=self.context, signal_handler_options=SignalHandlerOptions.NO)
        self.node = rclpy.create_node("ears", context=self.context)
        self.executor = _executor(self.context)
        self.executor.add_node(self.node)
        for name, kind in topics.items():
            self.node.create_subscription(kind, name, partial(self._hear, name), QoSProfile(depth=4000), raw=True)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _hear(self, name: str, raw: bytes) -> None:
        self.heard[name].append(bytes(raw))

    def _spin(self) -> None:
        with contextlib.suppress(rclpy.executors.ExternalShutdownException):
            while not self._ended.is_set():
                self.executor.spin_once(timeout_sec=0.1)

    def wait(
        self, done: Callable[[], Any], timeout: float, what: str, check: Callable[[], None] = lambda: None
    ) -> None:
        end = time.monotonic() + timeout
        while not done():
            assert time.monotonic() < end, f"no {what} within {timeout:g} s"
            check()
            time.sleep(0.02)

    def messages(self, name: str, raw: list[bytes] | None = None) -> list[Any]:
        return [deserialize_message(r, self.types[name]) for r in (self.heard[name] if raw is None else raw)]

    def stamps(self, name: str, first: int = 0) -> np.ndarray:
        """Of the messages from number `first` on, ns."""
        return np.array([stamp_ns(raw) for raw in self.heard[name][first:]], dtype=np.int64)

    def close(self) -> None:
        self._ended.set()
        self._thread.join(5.0)
        self.node.destroy_node()
        self.context.try_shutdown()


def _executor(context: Context) -> Any:
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        from rclpy.executors import SingleThreadedExecutor

        return SingleThreadedExecutor(context=context)
    return EventsExecutor(context=context)
