"""The messages of a simulated run: what driver and rig publish, serialised in batches.

Scales are the driver's; see INTERFACES in docs for topics, types and conventions.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.typesys.store import Typestore

from gsense_rig.recording.cdr import Template

Array = npt.NDArray[np.float64]
Values = dict[str, npt.ArrayLike]
_XYZ = ("x", "y", "z")
_NOT_REPORTED = -1.0
_UNKNOWN_AXIS = 1e6
DISCHARGING, HEALTH_GOOD, LION = 2, 1, 2
"""Constants of BatteryState."""


@dataclass(frozen=True)
class Batch:
    """Serialised messages of one topic: `log_ns` is when a recorder receives them."""

    topic: str
    msgtype: str
    log_ns: npt.NDArray[np.int64]
    rows: npt.NDArray[np.uint8]
    """(n, size)."""
    depth: int = field(default=200)
    """The publisher's queue: a second's messages."""


class RunMessages:
    """Templates of every topic; each method makes one topic's batch from arrays of shape (n,) or (n, 3)."""

    def __init__(self, store: Typestore, unit_id: str, epoch_ns: int) -> None:
        """`epoch_ns`: the host's time at the session's zero; stamps below are s of the session."""
        self._store = store
        self._epoch_ns = epoch_ns
        self._types = store.types
        self._unit_id = unit_id
        self.topics = {name: str(value) for name, _, value in store.fielddefs["gsense_msgs/msg/Topics"][0]}

    def imu(self, sensor: str, stamp: Array, latency: Array, rate: Array, force: Array | None) -> Batch:
        """Raw Imu; `force` None: acceleration is not reported, and the rate is about z alone."""
        values: Values = {"orientation_covariance.0": _NOT_REPORTED}
        values |= _vector("angular_velocity", rate)
        if force is None:
            values |= {"linear_acceleration_covariance.0": _NOT_REPORTED}
            values |= {"angular_velocity_covariance.0": _UNKNOWN_AXIS, "angular_velocity_covariance.4": _UNKNOWN_AXIS}
        else:
            values |= _vector("linear_acceleration", force)
        example = self._imu(f"{sensor}_link")
        return self._batch(self._topic(sensor, "IMU_RAW"), example, stamp, latency, values)

    def own_attitude(self, stamp: Array, latency: Array, quaternion: Array, force: Array) -> Batch:
        """Imu of the BNO055's own fusion: attitude (x, y, z, w), shape (n, 4); the rate is not reported."""
        values: Values = {"angular_velocity_covariance.0": _NOT_REPORTED}
        values |= {f"orientation.{axis}": quaternion[:, i] for i, axis in enumerate((*_XYZ, "w"))}
        values |= _vector("linear_acceleration", force)
        return self._batch(self._topic("bno055", "IMU"), self._imu("bno055_link"), stamp, latency, values)

    def magnetic_field(self, stamp: Array, latency: Array, tesla: Array) -> Batch:
        """MagneticField of the BNO055."""
        t = self._types
        example = t["sensor_msgs/msg/MagneticField"](
            header=self._header("bno055_link"), magnetic_field=self._vector3(), magnetic_field_covariance=np.zeros(9)
        )
        topic = self._topic("bno055", "IMU_MAG")
        return self._batch(topic, example, stamp, latency, _vector("magnetic_field", tesla), depth=20)

    def temperature(self, sensor: str, stamp: Array, latency: Array, celsius: Array) -> Batch:
        """Temperature of a die."""
        example = self._types["sensor_msgs/msg/Temperature"](
            header=self._header(f"{sensor}_link"), temperature=0.0, variance=0.0
        )
        topic = self._topic(sensor, "TEMPERATURE")
        return self._batch(topic, example, stamp, latency, {"temperature": celsius}, depth=20)

    def battery(self, stamp: Array, latency: Array, volts: Array) -> Batch:
        """BatteryState of the board's cell."""
        nan = float("nan")
        example = self._types["sensor_msgs/msg/BatteryState"](
            header=self._header("board"),
            voltage=nan,
            temperature=nan,
            current=nan,
            charge=nan,
            capacity=nan,
            design_capacity=nan,
            percentage=nan,
            power_supply_status=DISCHARGING,
            power_supply_health=HEALTH_GOOD,
            power_supply_technology=LION,
            present=True,
            cell_voltage=np.zeros(1, dtype=np.float32),
            cell_temperature=np.zeros(0, dtype=np.float32),
            location="",
            serial_number="",
        )
        return self._batch(
            self.topics["BATTERY"], example, stamp, latency, {"voltage": volts, "cell_voltage.0": volts}, depth=5
        )

    def link(self, stamp: Array, latency: Array, values: Mapping[str, npt.ArrayLike]) -> Batch:
        """LinkStatus; `values` by field."""
        example = self._types["gsense_msgs/msg/LinkStatus"](
            header=self._header(""),
            **dict.fromkeys(("received", "lost", "corrupt", "duplicate", "reordered", "restarts"), 0),
            **dict.fromkeys(("rate_hz", "clock_offset_s", "clock_skew_ppm", "uptime_s"), 0.0),
            unit_id=self._unit_id,
        )
        return self._batch(self.topics["LINK"], example, stamp, latency, values, depth=5)

    def pose(self, stamp: Array, latency: Array, position: Array) -> Batch:
        """Encoder pose."""
        t = self._types
        example = t["geometry_msgs/msg/PoseStamped"](
            header=self._header(self.topics["RAIL_FRAME"]),
            pose=t["geometry_msgs/msg/Pose"](
                position=t["geometry_msgs/msg/Point"](x=0.0, y=0.0, z=0.0), orientation=self._no_rotation()
            ),
        )
        return self._batch(self.topics["RIG_POSE"], example, stamp, latency, {"pose.position.x": position})

    def joint_states(self, stamp: Array, latency: Array, position: Array, velocity: Array, effort: Array) -> Batch:
        """JointState of the carriage."""
        example = self._types["sensor_msgs/msg/JointState"](
            header=self._header(self.topics["RAIL_FRAME"]),
            name=[self.topics["CARRIAGE_JOINT"]],
            position=np.zeros(1),
            velocity=np.zeros(1),
            effort=np.zeros(1),
        )
        values: Values = {"position.0": position, "velocity.0": velocity, "effort.0": effort}
        return self._batch(self.topics["RIG_JOINT_STATES"], example, stamp, latency, values)

    def rig_state(self, stamp: Array, latency: Array, values: Mapping[str, npt.ArrayLike]) -> Batch:
        """RigState; `values` by field."""
        example = self._types["gsense_msgs/msg/RigState"](
            header=self._header(self.topics["RAIL_FRAME"]),
            mode=0,
            switches=np.zeros(4, dtype=np.bool_),
            light=0,
            duty=0.0,
            current=0.0,
            reference=0.0,
            tracking_error=0.0,
            fault=0,
            fault_text="",
        )
        return self._batch(self.topics["RIG_STATE"], example, stamp, latency, values, depth=50)

    def _batch(
        self,
        topic: str,
        example: Any,
        stamp: Array,
        latency: Array,
        values: Mapping[str, npt.ArrayLike],
        depth: int = 200,
    ) -> Batch:
        template = Template(self._store, example)
        stamp_ns = self._epoch_ns + np.rint(stamp * 1e9).astype(np.int64)
        # A publisher's messages arrive in their order: one that is late holds up those behind it.
        log_ns = np.maximum.accumulate(stamp_ns + np.rint(latency * 1e9).astype(np.int64))
        return Batch("/" + topic, template.msgtype, log_ns, template.fill(stamp_ns, values), depth)

    def _topic(self, sensor: str, name: str) -> str:
        return f"{sensor}/{self.topics[name]}"

    def _header(self, frame: str) -> Any:
        time = self._types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
        return self._types["std_msgs/msg/Header"](stamp=time, frame_id=frame)

    def _vector3(self) -> Any:
        return self._types["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)

    def _no_rotation(self) -> Any:
        return self._types["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)

    def _imu(self, frame: str) -> Any:
        return self._types["sensor_msgs/msg/Imu"](
            header=self._header(frame),
            orientation=self._no_rotation(),
            orientation_covariance=np.zeros(9),
            angular_velocity=self._vector3(),
            angular_velocity_covariance=np.zeros(9),
            linear_acceleration=self._vector3(),
            linear_acceleration_covariance=np.zeros(9),
        )


def _vector(path: str, values: Array) -> Values:
    return {f"{path}.{axis}": values[:, i] for i, axis in enumerate(_XYZ)}
