"""Bags and recordings that the tests of gsense_fusion share."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

ROOT = Path(__file__).resolve().parents[2]
LINK_MSG = (ROOT / "src/gsense_msgs/msg/LinkStatus.msg").read_text(encoding="utf-8")
STATE_MSG = (ROOT / "src/gsense_msgs/msg/RigState.msg").read_text(encoding="utf-8")
OTHER_MSG = "std_msgs/Header header\nfloat64[] readings\nstring remark\n"

STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg(LINK_MSG, "gsense_msgs/msg/LinkStatus"))
STORE.register(get_types_from_msg(STATE_MSG, "gsense_msgs/msg/RigState"))
STORE.register(get_types_from_msg(OTHER_MSG, "unheard_of_msgs/msg/Reading"))

START_NS = 1_760_000_000_000_000_000


def recordings(*parts: str) -> Path:
    """A measured recording; skips the test where it is not on this machine."""
    home = Path(os.environ.get("GSENSE_DATA", ROOT.parent / "shared" / "data"))
    path = home.joinpath(*parts)
    if not path.exists():
        pytest.skip(f"recording {'/'.join(parts)} is not here ({home}; set GSENSE_DATA to the folder of recordings)")
    return path


def message(kind: str, **fields: Any) -> Any:
    """A message of type `kind` with the given fields, all else zero or empty."""
    return STORE.types[kind](**{name: fields.get(name, _default(spec)) for name, spec in STORE.fielddefs[kind][1]})


def _default(spec: Any) -> Any:
    node, detail = int(spec[0]), spec[1]
    if node == 1:  # a primitive
        name = detail[0]
        return "" if name == "string" else False if name == "bool" else 0.0 if "float" in name else 0
    if node == 2:  # a message
        return message(detail)
    (inner, size) = detail
    if int(inner[0]) == 1 and inner[1][0] != "string":
        return np.zeros(size if node == 3 else 0, dtype=inner[1][0].replace("octet", "uint8"))
    return [_default(inner) for _ in range(size)] if node == 3 else []


def header(stamp_ns: int, frame: str = "imu_link") -> Any:
    stamp = message("builtin_interfaces/msg/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return message("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def vector(values: Any) -> Any:
    return message("geometry_msgs/msg/Vector3", **dict(zip("xyz", map(float, values), strict=True)))


def quaternion(wxyz: Any) -> Any:
    return message("geometry_msgs/msg/Quaternion", **dict(zip("wxyz", map(float, wxyz), strict=True)))


def imu(stamp_ns: int, rate: Any, force: Any | None, frame: str = "imu_link", **fields: Any) -> Any:
    """An Imu; `force` None is a sensor without accelerometer."""
    none = np.array([-1.0] + [0.0] * 8)
    covariance = {} if force is not None else {"linear_acceleration_covariance": none}
    return message(
        "sensor_msgs/msg/Imu",
        header=header(stamp_ns, frame),
        orientation=quaternion((1, 0, 0, 0)),
        orientation_covariance=none,
        angular_velocity=vector(rate),
        linear_acceleration=vector(force if force is not None else (0, 0, 0)),
        **covariance,
        **fields,
    )


@dataclass
class BagWriter:
    """Collects messages and writes them as one bag."""

    messages: list[tuple[str, int, Any]] = field(default_factory=list)

    def add(self, topic: str, stamp_ns: int, content: Any) -> None:
        self.messages.append((topic, stamp_ns, content))

    def write(
        self, path: Path, storage: StoragePlugin = StoragePlugin.MCAP, compression: str = "none", version: int = 9
    ) -> Path:
        writer = Writer(path, version=version, storage_plugin=storage)  # type: ignore[arg-type]
        if compression != "none":
            writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
        with writer:
            connections: dict[str, Any] = {}
            for topic, stamp, content in self.messages:
                kind = content.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
                writer.write(connections[topic], stamp, STORE.serialize_cdr(content, kind))
        return path


def rail_bag(count: int = 400, prefix: str = "/") -> BagWriter:
    """A short run on the rail with every topic that a session records, 200 Hz, known values in every field."""
    bag = BagWriter()
    for i in range(count):
        at = START_NS + 5_000_000 * i
        bag.add(f"{prefix}mpu6050/imu/data_raw", at + 400_000, imu(at, (i, -i, 0.5 * i), (0.1 * i, 0.2, 9.81)))
        position = message("geometry_msgs/msg/Point", x=0.001 * i)
        pose = message("geometry_msgs/msg/Pose", position=position, orientation=quaternion((1, 0, 0, 0)))
        bag.add(f"{prefix}rig/pose", at, message("geometry_msgs/msg/PoseStamped", header=header(at, "rail"), pose=pose))
        joint = message(
            "sensor_msgs/msg/JointState",
            header=header(at, ""),
            name=["carriage"],
            position=np.array([0.001 * i]),
            velocity=np.array([0.2]),
        )
        bag.add(f"{prefix}rig/joint_states", at, joint)
        if i % 20 == 0:
            _slow_topics(bag, prefix, at, i)
    return bag


def _slow_topics(bag: BagWriter, prefix: str, at: int, i: int) -> None:
    bag.add(
        f"{prefix}mpu6050/temperature",
        at,
        message("sensor_msgs/msg/Temperature", header=header(at), temperature=25.0 + 0.01 * i),
    )
    bag.add(f"{prefix}battery", at, message("sensor_msgs/msg/BatteryState", header=header(at), voltage=3.75))
    field_ = message("sensor_msgs/msg/MagneticField", header=header(at), magnetic_field=vector((2e-5, 1e-6, -4e-5)))
    bag.add(f"{prefix}mpu6050/imu/mag", at, field_)
    link = message(
        "gsense_msgs/msg/LinkStatus", header=header(at), received=1000 + i, lost=7 + i // 100, unit_id="board-3"
    )
    bag.add(f"{prefix}link", at, link)
    other = message("unheard_of_msgs/msg/Reading", header=header(at), readings=np.arange(i % 7, dtype=float))
    bag.add(f"{prefix}other", at, other)
