"""`fusion`: attitude of one sensor, live, without and with g-compensation.

Subscribes `<sensor>/imu/data_raw`, `<sensor>/imu/mag`, `<sensor>/temperature`, `battery`, `rig/joint_states`; publishes
`<sensor>/<filter>/imu/data` and, with a compensation file, `<sensor>/<filter>_gcomp/imu/data`, and `/diagnostics`. All
the thinking is in `attitude.fusion`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import BatteryState, Imu, JointState, MagneticField, Temperature

from gsense_driver.user_input.parameters import refuse_unknown

from .attitude.fusion import Fusion
from .attitude.registry import UnknownFilterError, channels
from .bags.imu_message import packed, parse_imu
from .bags.topics import sensor_name
from .compensation import CompensationError, CompensationFile, load_compensation
from .fusion_diagnostics import diagnostic
from .fusion_output import Uncertainty, output_message
from .fusion_parameters import declare
from .inputs import Inputs
from .node_process import run_node
from .sensor_topics import SensorTopics

_DEPTH = 5000
"""Ten seconds at 500 Hz: a stall of the machine loses nothing."""
_QOS = QoSProfile(depth=_DEPTH, history=HistoryPolicy.KEEP_LAST, reliability=ReliabilityPolicy.RELIABLE)
_UNREPORTED = np.full(3, np.nan)


ABOUT = "Attitude of one sensor, live, without and with g-compensation."


class FusionNode(Node):
    """Wires topics to `Fusion`."""

    def __init__(self) -> None:
        super().__init__("fusion")
        declare(self)
        refuse_unknown(self)
        self._asked = str(self.get_parameter("sensor").value)
        topics = SensorTopics.of(self._asked)
        self.sensor = topics.name
        file = self._compensation_file()
        names = self._filter_names()
        self.fusion = Fusion(channels(names, with_compensation=file is not None, parameters=self._gains()), file)
        self._outputs: dict[str, Any] = {
            channel.name: self.create_publisher(Imu, f"{self.sensor}/{channel.name}/imu/data", _QOS)
            for channel in self.fusion.channels
        }
        uncertainty = Uncertainty(
            float(self.get_parameter("inclination_stddev").value), float(self.get_parameter("heading_stddev").value)
        )
        self._covariance = {known: packed(uncertainty.covariance(heading_known=known)) for known in (False, True)}
        self._told = ""
        self._malformed = 0
        # as bytes: spares the conversion of messages into Python objects and back
        inputs = Inputs(self, _DEPTH)
        inputs.subscribe(Imu, topics.imu, self._on_imu, raw=True)
        inputs.subscribe(Temperature, topics.temperature, self._on_temperature)
        inputs.subscribe(BatteryState, "battery", self._on_battery)
        inputs.subscribe(JointState, "rig/joint_states", self._on_joint)
        if self._uses_mag():
            inputs.subscribe(MagneticField, topics.mag, self._on_mag)
        if any(channel.uses_own for channel in self.fusion.channels):
            inputs.subscribe(Imu, topics.own, self._on_own, raw=True)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self.create_timer(1.0, self._on_second)
        self.get_logger().info(f"{self.sensor}: {', '.join(self._outputs)}" + (f", by {self._path}" if file else ""))

    def _compensation_file(self) -> CompensationFile | None:
        self._path = str(self.get_parameter("compensation_file").value)
        if not self._path:
            return None
        file = load_compensation(Path(self._path).expanduser())
        if sensor_name(file.sensor).strip("/") != sensor_name(self._asked).strip("/"):
            raise CompensationError(f"{self._path}: sensor: is for {file.sensor!r}, this node runs {self.sensor!r}")
        if file.unit_id:
            self.get_logger().info(f"{self._path} was made for unit {file.unit_id!r}")
        return file

    def _filter_names(self) -> list[str]:
        value = self.get_parameter("filter").value
        names = [value] if isinstance(value, str) else value
        if not isinstance(names, (list, tuple)) or not names or not all(isinstance(name, str) for name in names):
            raise UnknownFilterError(f"parameter filter: a name or a list of names is needed, not {value!r}")
        return list(dict.fromkeys(names))

    def _gains(self) -> dict[str, dict[str, float]]:
        beta = float(self.get_parameter("beta").value)
        return {"madgwick": {"beta_imu": beta, "beta_marg": beta}} if beta > 0 else {}

    def _uses_mag(self) -> bool:
        value = self.get_parameter("use_mag").value
        if value == "auto":
            return True
        if not isinstance(value, bool):
            raise ValueError(f"parameter use_mag: true, false or auto is needed, not {value!r}")  # noqa: TRY004
        return value

    def _on_imu(self, data: bytes) -> None:
        try:
            message = parse_imu(data)
        except ValueError as error:
            self._malformed += 1
            self.get_logger().warning(f"{self.sensor}: {self._malformed} messages left out: {error}", once=True)
            return
        if message.rate_covariance[0] == -1.0:
            return
        force = np.array(message.force) if message.force_covariance[0] != -1.0 else _UNREPORTED
        estimates = self.fusion.add_sample(message.stamp_ns, np.array(message.rate), force, message)
        covariance = self._covariance[self.fusion.status.uses_field]
        for estimate in estimates:
            self._outputs[estimate.channel].publish(output_message(estimate, covariance))
        if estimates and self.fusion.status.start != self._told:
            self._tell()

    def _on_own(self, data: bytes) -> None:
        try:
            x, y, z, w, covariance = parse_imu(data).values[:5]
        except ValueError:
            return
        if covariance != -1.0:
            self.fusion.add_own(np.array([w, x, y, z]))

    def _on_mag(self, message: Any) -> None:
        field = message.magnetic_field
        self.fusion.add_field(np.array([field.x, field.y, field.z]))

    def _on_temperature(self, message: Any) -> None:
        self.fusion.add_temperature(message.temperature)

    def _on_battery(self, message: Any) -> None:
        self.fusion.add_supply(message.voltage)

    def _on_joint(self, message: Any) -> None:
        index = message.name.index("carriage") if "carriage" in message.name else 0
        if index >= len(message.position):
            return
        velocity = message.velocity[index] if index < len(message.velocity) else np.nan
        stamp = message.header.stamp
        self.fusion.add_carriage(stamp.sec * 1_000_000_000 + stamp.nanosec, message.position[index], velocity)

    def _tell(self) -> None:
        status = self.fusion.status
        self._told = status.start
        bias = np.degrees(status.bias[False])
        text = f"{self.sensor}: {status.start} (bias {bias[0]:.3f} {bias[1]:.3f} {bias[2]:.3f} deg/s)"
        if status.rest_seen:  # a call of its own for each severity: rclpy refuses to change one from call to call
            self.get_logger().info(text)
        else:
            self.get_logger().warning(text)

    def _on_second(self) -> None:
        name = f"{self.get_fully_qualified_name().lstrip('/')}: {self.sensor}"
        message = DiagnosticArray(status=[diagnostic(name, self.sensor, self.fusion.status)])
        message.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(message)


def main() -> int:
    """Run the node until SIGINT or SIGTERM; the exit code as in `run_node`."""
    return run_node("fusion", ABOUT, FusionNode, declare, (CompensationError, UnknownFilterError, ValueError))


if __name__ == "__main__":
    sys.exit(main())
