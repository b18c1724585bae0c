"""The recording node: subscribes to what appears in the graph and hands every message to the bag's thread."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.node import Node
from rosbags.typesys.store import Typestore

from gsense_rig.recording import discovery
from gsense_rig.recording.typestore import knows
from gsense_rig.recording.writer_thread import BagThread, Summary, Topic

DISCOVERY_PERIOD = 0.1
"""s."""


class RecorderNode(Node):
    """Parameters `out` (folder of the bag) and `topics` (names; empty: all that are not hidden)."""

    def __init__(self, store: Typestore) -> None:
        super().__init__("record")
        self.declare_parameter("out", "")
        self.declare_parameter("topics", [""])
        self._store = store
        self._bag: BagThread | None = None
        self._subscriptions_by_topic: dict[str, Any] = {}
        self._skipped: set[str] = set()

    def begin(self) -> Path:
        """Creates the bag; raises `rosbags.rosbag2.WriterError` or OSError where that is not possible."""
        name = self.get_parameter("out").value or time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S")
        self._wanted = discovery.Wanted.resolve(self, self.get_parameter("topics").value or [])
        bag = Path(name).absolute()
        self._bag = BagThread(bag, self._store)
        self.discover()
        self.create_timer(DISCOVERY_PERIOD, self.discover)
        return bag

    @property
    def error(self) -> str | None:
        """Why the bag can no longer be written."""
        return self._bag.error if self._bag is not None else None

    def finish(self) -> Summary:
        """Ends the subscriptions and closes the bag."""
        if self._bag is None:
            raise RuntimeError("finish() before begin()")
        for subscription in self._subscriptions_by_topic.values():
            self.destroy_subscription(subscription)
        return self._bag.finish()

    def discover(self) -> None:
        """Subscribes to topics that are wanted and new."""
        for name, types in self.get_topic_names_and_types():
            if name in self._subscriptions_by_topic or name in self._skipped or name not in self._wanted:
                continue
            publishers = self.get_publishers_info_by_topic(name)
            if publishers:
                self._subscribe(name, types[0], publishers)

    def _subscribe(self, name: str, msgtype: str, publishers: list[Any]) -> None:
        assert self._bag is not None  # noqa: S101 - begin() calls discover()
        message = discovery.message_class(msgtype)
        if message is None or not knows(self._store, msgtype):
            self._skipped.add(name)
            self.get_logger().warning(f"{name} is not recorded: {msgtype} is not installed here")
            return
        qos = tuple(discovery.recorded_qos(publisher.qos_profile) for publisher in publishers)
        self._bag.add_topic(Topic(name, msgtype, qos))
        callback = partial(self._receive, name)
        profile = discovery.subscription_qos(publishers)
        self._subscriptions_by_topic[name] = self.create_subscription(message, name, callback, profile, raw=True)
        self.get_logger().info(f"recording {name}")

    def _receive(self, name: str, data: bytes) -> None:
        assert self._bag is not None  # noqa: S101 - subscriptions exist after begin()
        self._bag.put(name, time.time_ns(), bytes(data))
