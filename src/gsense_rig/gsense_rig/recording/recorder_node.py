"""The recording node: subscribes to what appears in the graph and hands every message to the bag's thread."""

from __future__ import annotations

import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.event_handler import SubscriptionEventCallbacks, UnsupportedEventTypeError
from rclpy.node import Node
from rosbags.typesys.store import Typestore

from gsense_driver.user_input.parameters import refuse_unknown
from gsense_rig.recording import discovery
from gsense_rig.recording.typestore import knows
from gsense_rig.recording.writer_thread import MAX_QUEUE, BagThread, Summary, Topic

DISCOVERY_PERIOD = 0.1
"""s."""


class RecorderNode(Node):
    """Subscribes to topics as they appear, and writes what they bring."""

    def __init__(self, store: Typestore, **options: Any) -> None:
        """`options` are rclpy's of a node."""
        super().__init__("record", **options)
        self.heard: Counter[str] = Counter()
        self._declare()
        refuse_unknown(self)
        self._store = store
        self._bag: BagThread | None = None
        self._subscriptions_by_topic: dict[str, Any] = {}
        self._skipped: set[str] = set()
        self._lost: Counter[str] = Counter()
        self._told = 0

    def _declare(self) -> None:
        for name, default, text in (
            ("out", "", "folder of the bag; empty: named by the time"),
            ("topics", [""], "names; empty: all that are not hidden"),
            ("max_bag_size", 0, "bytes of a storage file after which the next one is begun; 0: never"),
            ("max_queue", MAX_QUEUE, "bytes that may wait for the disk"),
        ):
            self.declare_parameter(name, default, ParameterDescriptor(description=text, read_only=True))

    def begin(self) -> Path:
        """Creates the bag; raises `rosbags.rosbag2.WriterError` or OSError where that is not possible."""
        name = self.get_parameter("out").value or time.strftime("rosbag2_%Y_%m_%d-%H_%M_%S")
        self._wanted = discovery.Wanted.resolve(self, self.get_parameter("topics").value or [])
        bag = Path(name).absolute()
        self._bag = BagThread(
            bag, self._store, self.get_parameter("max_bag_size").value, self.get_parameter("max_queue").value
        )
        self.discover()
        self.create_timer(DISCOVERY_PERIOD, self.discover)
        return bag

    @property
    def error(self) -> str | None:
        """Why the bag can no longer be written."""
        return self._bag.error if self._bag is not None else None

    @property
    def skipped(self) -> list[str]:
        """Topics whose type is not installed here."""
        return sorted(self._skipped)

    @property
    def never_seen(self) -> list[str]:
        """Topics that were asked for and that nobody published."""
        return sorted(self._wanted.names - set(self._subscriptions_by_topic) - self._skipped)

    @property
    def lost(self) -> dict[str, int]:
        """Messages that the middleware reports as lost, by topic."""
        return dict(self._lost)

    def finish(self) -> Summary:
        """Ends the subscriptions and closes the bag."""
        if self._bag is None:
            raise RuntimeError("finish() before begin()")
        for subscription in self._subscriptions_by_topic.values():
            self.destroy_subscription(subscription)
        return self._bag.finish()

    def discover(self) -> None:
        """Subscribes to topics that are wanted and new; says where messages are dropped."""
        self._tell_overflow()
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
        events = SubscriptionEventCallbacks(message_lost=partial(self._note_lost, name))
        try:
            subscription = self.create_subscription(message, name, callback, profile, raw=True, event_callbacks=events)
        except UnsupportedEventTypeError:
            subscription = self.create_subscription(message, name, callback, profile, raw=True)
        self._subscriptions_by_topic[name] = subscription
        self.get_logger().info(f"recording {name}")

    def _note_lost(self, name: str, event: Any) -> None:
        self._lost[name] = event.total_count

    def _tell_overflow(self) -> None:
        dropped = self._bag.overflow if self._bag is not None else 0
        if dropped > self._told:
            self.get_logger().error(f"the disk is too slow: {dropped} messages dropped so far")
            self._told = dropped

    def _receive(self, name: str, data: bytes) -> None:
        assert self._bag is not None  # noqa: S101 - subscriptions exist after begin()
        self._bag.put(name, time.time_ns(), bytes(data))
        self.heard[name] += 1
