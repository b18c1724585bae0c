"""`watch`: is a new effect entering the data right now?

Subscribes `<sensor>/imu/data_raw`, `<sensor>/temperature`, `battery`, `rig/joint_states`; publishes
`<sensor>/residual` (measured minus predicted rate) and `/diagnostics`. All the thinking is in `watch/`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Vector3Stamped
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import BatteryState, Imu, JointState, Temperature

from gsense_driver.user_input.parameters import refuse_unknown

from .bags.topics import sensor_name
from .compensation import CompensationError, load_compensation
from .inputs import Inputs
from .node_process import run_node
from .sensor_topics import SensorTopics
from .watch import Prediction, Watcher, WatchReport
from .watch_diagnostics import diagnostic

_DEPTH = 2000
_QOS = QoSProfile(depth=_DEPTH, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE)
_UNREPORTED = np.full(3, np.nan)


ABOUT = "Says where an effect that the compensation file lacks enters the data."


class WatchNode(Node):
    """Wires topics to `Prediction` and `Watcher`."""

    def __init__(self) -> None:
        super().__init__("watch")
        declare(self)
        refuse_unknown(self)
        asked = str(self.get_parameter("sensor").value)
        topics = SensorTopics.of(asked)
        self.sensor = topics.name
        path = str(self.get_parameter("compensation_file").value)
        if not path:
            raise CompensationError("parameter compensation_file: is needed; close_loop writes it")
        file = load_compensation(Path(path).expanduser())
        if sensor_name(file.sensor).strip("/") != sensor_name(asked).strip("/"):
            raise CompensationError(f"{path}: sensor: is for {file.sensor!r}, this node watches {self.sensor!r}")
        self.prediction = Prediction(file)
        self.watcher = Watcher(reference=file.reference)
        self.report: WatchReport | None = None
        self._testing: Thread | None = None
        self._carriage = (0.0, 0.0)
        self._residual = self.create_publisher(Vector3Stamped, f"{self.sensor}/residual", _QOS)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        inputs = Inputs(self, _DEPTH)
        inputs.subscribe(Imu, topics.imu, self._on_imu)
        inputs.subscribe(Temperature, topics.temperature, self._on_temperature)
        inputs.subscribe(BatteryState, "battery", self._on_battery)
        inputs.subscribe(JointState, "rig/joint_states", self._on_joints)
        self.create_timer(1.0, self._on_second)
        self.get_logger().info(f"{self.sensor}: watched against {path}")

    def _on_imu(self, message: Any) -> None:
        stamp = message.header.stamp
        rate, force = message.angular_velocity, message.linear_acceleration
        if message.angular_velocity_covariance[0] == -1.0:
            return
        stamp_ns = stamp.sec * 1_000_000_000 + stamp.nanosec
        reported = message.linear_acceleration_covariance[0] != -1.0
        felt = np.array([force.x, force.y, force.z]) if reported else _UNREPORTED
        known_bias = self.prediction.bias_from_rest
        residual = self.prediction.residual(stamp_ns, np.array([rate.x, rate.y, rate.z]), felt)
        if self.prediction.bias_from_rest != known_bias:
            self.watcher.begin_anew(stamp_ns * 1e-9)
        known = self.watcher.known_rate(stamp_ns * 1e-9, *self._carriage, felt)
        out = Vector3Stamped(header=message.header)
        out.vector.x, out.vector.y, out.vector.z = (residual - known).tolist()
        self._residual.publish(out)
        self.watcher.add_sample(stamp_ns * 1e-9, residual, felt)
        if self.watcher.due() and (self._testing is None or not self._testing.is_alive()):
            self._testing = Thread(target=self._test, args=(self.watcher.window(),), daemon=True)
            self._testing.start()

    def _test(self, window: Any) -> None:
        """A test takes a tenth of a second: beside the callbacks, or samples would wait for it."""
        self.report = self.watcher.test(window)
        for alarm in self.report.fresh:
            self.get_logger().warning(f"{self.sensor}: {alarm.text}")

    def _on_temperature(self, message: Any) -> None:
        self.prediction.compensator.set_temperature(message.temperature)

    def _on_battery(self, message: Any) -> None:
        self.prediction.compensator.set_supply(message.voltage)

    def _on_joints(self, message: Any) -> None:
        if "carriage" not in message.name:
            return
        index = message.name.index("carriage")
        stamp = message.header.stamp
        if index >= len(message.position) or index >= len(message.velocity):
            return
        self._carriage = message.position[index], message.velocity[index]
        self.prediction.compensator.set_carriage_velocity(message.velocity[index])
        self.watcher.add_position(stamp.sec + stamp.nanosec * 1e-9, message.position[index])

    def _on_second(self) -> None:
        name = f"{self.get_fully_qualified_name().lstrip('/')}: {self.sensor}"
        status = diagnostic(name, self.sensor, self.report, bias_from_rest=self.prediction.bias_from_rest)
        message = DiagnosticArray(status=[status])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)


def declare(node: Node) -> None:
    """Declare the parameters of `watch`."""
    for name, default, text in (
        ("sensor", "mpu6050", "the sensor's name, first part of its topics; or a whole topic"),
        ("compensation_file", "", "compensation.yaml that close_loop or calibrate wrote; needed"),
    ):
        node.declare_parameter(name, default, ParameterDescriptor(description=text, read_only=True))


def main() -> int:
    """Run the node until SIGINT or SIGTERM; the exit code as in `run_node`."""
    return run_node("watch", ABOUT, WatchNode, declare, (CompensationError, ValueError))


if __name__ == "__main__":
    sys.exit(main())
