"""The dashboard's node: keeps raw messages until the page's next tick; what is decoded goes into the state."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from gsense_msgs.msg import LinkStatus, RigState, Topics
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import BatteryState, Imu, JointState, Temperature

from gsense_driver.user_input.parameters import refuse_unknown
from gsense_rig.dashboard import messages
from gsense_rig.dashboard.settings import DashboardSettings, declare
from gsense_rig.dashboard.snapshot import GCOMP
from gsense_rig.dashboard.state import GraphState, raw_sensor, sensor_and_filter

DISCOVERY_PERIOD = 0.5  # s
MAX_WAITING = 20_000  # messages; some 10 s of everything
CAMPAIGN = "campaign"  # the name of that command's node
IMU_TYPE = "sensor_msgs/msg/Imu"

Take = Callable[[Any, float], None]


def subscription_qos() -> QoSProfile:
    """Best effort: matches every publisher, and a page that is late must not slow down the graph."""
    return QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=400, reliability=ReliabilityPolicy.BEST_EFFORT)


class DashboardNode(Node):
    """Subscribes; raw sensors and filters as they appear. Its callbacks run in the executor's thread and only queue.

    `drain` is for the server's thread.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("dashboard", **options)
        self.settings: DashboardSettings = declare(self)
        refuse_unknown(self)
        self.state = GraphState()
        self.watched: frozenset[tuple[str, str]] = frozenset()
        """Sensor and filter of each page; set by the server."""
        self.campaign_runs = False
        self._waiting: deque[tuple[Take, Any, bytes]] = deque(maxlen=MAX_WAITING)
        self._heard: set[str] = set()
        self._filters: dict[str, tuple[str, ...]] = {}
        self._hear(RigState, Topics.RIG_STATE, lambda m, now: self.state.take_rig(messages.rig(m), now))
        self._hear(JointState, Topics.RIG_JOINT_STATES, lambda m, _now: messages.take_joint(self.state, m))
        self._hear(LinkStatus, Topics.LINK, self._take_link)
        self._hear(BatteryState, Topics.BATTERY, self._take_battery)
        self._hear(DiagnosticArray, Topics.DIAGNOSTICS, self._take_diagnostics)
        self.create_timer(DISCOVERY_PERIOD, self._discover)

    # ---- the executor's thread

    def _hear(self, kind: Any, topic: str, take: Take) -> None:
        self._heard.add(topic)
        self.create_subscription(
            kind, topic, lambda raw: self._waiting.append((take, kind, raw)), subscription_qos(), raw=True
        )

    def _discover(self) -> None:
        """Subscribe to sensors that are new, and to the filters that a page shows."""
        filters: dict[str, list[str]] = {}
        for topic, types in self.get_topic_names_and_types():
            if IMU_TYPE not in types or not self.count_publishers(topic):
                continue
            sensor = raw_sensor(topic, self.get_namespace())
            if sensor is not None:
                self._hear_sensor(sensor)
            pair = sensor_and_filter(topic, self.get_namespace())
            if pair is not None:
                filters.setdefault(pair[0], []).append(pair[1])
                self._hear_orientation(*pair)
        self._filters = {sensor: tuple(sorted(names)) for sensor, names in filters.items()}
        names = self.get_node_names_and_namespaces()
        self.campaign_runs = (CAMPAIGN, self.get_namespace()) in names

    def _hear_sensor(self, sensor: str) -> None:
        topic = f"{sensor}/{Topics.IMU_RAW}"
        if topic not in self._heard:
            self._hear(Imu, topic, partial(self._take_imu, sensor))
            self._hear(Temperature, f"{sensor}/{Topics.TEMPERATURE}", partial(self._take_temperature, sensor))

    def _hear_orientation(self, sensor: str, name: str) -> None:
        topic = f"{sensor}/{name}/{Topics.IMU}"
        if topic not in self._heard and (sensor, name.removesuffix(GCOMP)) in self.watched:
            self._hear(Imu, topic, partial(self._take_orientation, sensor, name))

    # ---- the server's thread

    def drain(self) -> None:
        """Decode what has come."""
        now = time.monotonic()
        for _ in range(len(self._waiting)):
            take, kind, raw = self._waiting.popleft()
            take(deserialize_message(raw, kind), now)
        self.state.filters = self._filters

    def _take_imu(self, sensor: str, message: Any, now: float) -> None:
        messages.take_imu(self.state, sensor, message, now)

    def _take_orientation(self, sensor: str, name: str, message: Any, now: float) -> None:
        messages.take_orientation(self.state, sensor, name, message, now)

    def _take_temperature(self, sensor: str, message: Any, _now: float) -> None:
        self.state.sensors[sensor].temperature = message.temperature

    def _take_link(self, message: Any, now: float) -> None:
        self.state.take_link(messages.link(message, self.state.link), now)

    def _take_battery(self, message: Any, _now: float) -> None:
        self.state.battery = messages.battery(message)

    def _take_diagnostics(self, message: Any, now: float) -> None:
        messages.take_diagnostics(self.state, message, self.get_namespace(), now)
