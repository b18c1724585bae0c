"""Subscriptions that hear reliable publishers without loss, and best-effort ones at all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy

PERIOD = 0.5
"""s between looks at the publishers; costs some ten microseconds a topic."""


@dataclass
class _Input:
    kind: Any
    topic: str
    callback: Callable[[Any], None]
    raw: bool
    reliable: Any
    """Subscription."""
    best_effort: Any = None
    """Subscription, once it was needed."""
    listens_to_both: bool = False
    """A reliable publisher has come beside: what the best-effort subscription brings would come twice."""


class Inputs:
    """The inputs of a node.

    Drivers of other sensors often publish with the sensor-data profile, best effort, which a reliable subscription does
    not match at all: a second subscription is made as soon as such a publisher is seen. Nothing is destroyed meanwhile:
    the EventsExecutor of rclpy 7.1 fails on events of a subscription that is gone.
    """

    def __init__(self, node: Node, depth: int) -> None:
        self._node = node
        self._depth = depth
        self._inputs: list[_Input] = []
        node.create_timer(PERIOD, self.adapt)

    def subscribe(self, kind: Any, topic: str, callback: Callable[[Any], None], *, raw: bool = False) -> None:
        """As `Node.create_subscription`; `raw`: the callback takes bytes."""
        reliable = self._open(kind, topic, callback, raw, ReliabilityPolicy.RELIABLE)
        self._inputs.append(_Input(kind, topic, callback, raw, reliable))

    def adapt(self) -> None:
        """Listen to the best-effort publishers that have come."""
        for item in self._inputs:
            offered = self._node.get_publishers_info_by_topic(item.reliable.topic_name)
            kinds = {publisher.qos_profile.reliability for publisher in offered}
            item.listens_to_both = ReliabilityPolicy.RELIABLE in kinds
            if ReliabilityPolicy.BEST_EFFORT in kinds and item.best_effort is None:
                item.best_effort = self._listen(item)
                self._node.get_logger().info(
                    f"{item.topic}: its publisher is best effort: what is lost is not sent again"
                )

    def _listen(self, item: _Input) -> Any:
        def callback(message: Any) -> None:
            if not item.listens_to_both:
                item.callback(message)

        return self._open(item.kind, item.topic, callback, item.raw, ReliabilityPolicy.BEST_EFFORT)

    def _open(
        self, kind: Any, topic: str, callback: Callable[[Any], None], raw: bool, reliability: ReliabilityPolicy
    ) -> Any:
        qos = QoSProfile(depth=self._depth, history=HistoryPolicy.KEEP_LAST, reliability=reliability)
        quiet = SubscriptionEventCallbacks(use_default_callbacks=False)  # `adapt` says it in better words
        return self._node.create_subscription(kind, topic, callback, qos, raw=raw, event_callbacks=quiet)
