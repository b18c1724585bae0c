"""A long bag with all that a rig's recording has, made quickly: a carriage that swings, a board that only translates.

For the bench of `replay`: sensor, temperature, battery, rig topics, and a reference of the attitude.
"""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from gsense_fusion.bags.imu_message import build_many

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
G, AMPLITUDE, OMEGA, REST_S = 9.80665, 0.15, 7.0, 6.0
G_SENSITIVITY = 1.8e-4
"""(rad/s)/(m/s^2), about the axis across the rail."""
_STORE = get_typestore(Stores.ROS2_JAZZY)
_MARK = 1.2345678901e10


def write_hour(path: Path, samples: int, rate_hz: int, seed: int = 1) -> None:
    """Write the bag.

    Args:
        path: folder that is made.
        samples: of the sensor; the rig's topics and the reference have as many.
        rate_hz: of all three.
        seed: of the noise.
    """
    stamps = 1_760_000_000_000_000_000 + np.arange(samples) * (1_000_000_000 // rate_hz)
    t = np.arange(samples) / rate_hz - REST_S
    position = np.where(t > 0, AMPLITUDE * np.sin(OMEGA * t), 0.0)
    velocity = np.where(t > 0, AMPLITUDE * OMEGA * np.cos(OMEGA * t), 0.0)
    topics = {
        "/mpu6050/imu/data_raw": ("sensor_msgs/msg/Imu", stamps, _imu(position, seed, stamps)),
        "/rig/pose": _numbers("geometry_msgs/msg/PoseStamped", stamps, _pose("rail"), position),
        "/rig/joint_states": _numbers("sensor_msgs/msg/JointState", stamps, _joint(), position, velocity),
        "/reference/pose": _numbers("geometry_msgs/msg/PoseStamped", stamps, _pose("map"), 0.0 * position),
        "/mpu6050/temperature": _numbers(
            "sensor_msgs/msg/Temperature", stamps[:: rate_hz // 10], _temperature(), 25.0 + 0.0 * t[:: rate_hz // 10]
        ),
    }
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = [writer.add_connection(name, kind, typestore=_STORE) for name, (kind, _, _) in topics.items()]
        messages = [
            (int(when), connection, data)
            for connection, (_, whens, rows) in zip(connections, topics.values(), strict=True)
            for when, data in zip(whens, rows, strict=True)
        ]
        for when, connection, data in sorted(messages, key=lambda message: message[0]):
            writer.write(connection, when, data)


def _imu(position: FloatArray, seed: int, stamps: IntArray) -> list[bytes]:
    rng = np.random.default_rng(seed)
    acceleration = -(OMEGA**2) * position
    numbers = np.zeros((len(position), 37))
    numbers[:, 3], numbers[:, 4] = 1.0, -1.0
    numbers[:, 13:16] = rng.normal(size=(len(position), 3)) * 1e-3 + 0.01
    numbers[:, 14] += G_SENSITIVITY * acceleration
    numbers[:, 25:28] = np.array([0.0, 0.0, G]) + rng.normal(size=(len(position), 3)) * 0.04
    numbers[:, 25] += acceleration
    return build_many(stamps, "imu_link", numbers)


def _numbers(kind: str, stamps: IntArray, message: Any, *values: FloatArray) -> tuple[str, IntArray, list[bytes]]:
    """Copies of a message with their stamps, and with numbers where the message has `_MARK`, `_MARK` + 1, ..."""
    template = bytes(_STORE.serialize_cdr(message, kind))
    table = np.tile(np.frombuffer(template, np.uint8), (len(stamps), 1))
    table[:, 4:12] = np.stack(np.divmod(stamps, 1_000_000_000), axis=1).astype("<i4").view(np.uint8).reshape(-1, 8)
    for i, column in enumerate(values):
        at = template.index(struct.pack("<d", _MARK + i))
        table[:, at : at + 8] = np.ascontiguousarray(column, dtype="<f8").view(np.uint8).reshape(-1, 8)
    joined, size = table.tobytes(), len(template)
    return kind, stamps, [joined[i : i + size] for i in range(0, len(joined), size)]


def _header(frame: str) -> Any:
    types = _STORE.types
    return types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](0, 0), frame)


def _pose(frame: str) -> Any:
    types = _STORE.types
    pose = types["geometry_msgs/msg/Pose"](
        types["geometry_msgs/msg/Point"](_MARK, 0.0, 0.0), types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    )
    return types["geometry_msgs/msg/PoseStamped"](_header(frame), pose)


def _joint() -> Any:
    kind = _STORE.types["sensor_msgs/msg/JointState"]
    return kind(_header("rail"), ["carriage"], np.array([_MARK]), np.array([_MARK + 1]), np.empty(0))


def _temperature() -> Any:
    return _STORE.types["sensor_msgs/msg/Temperature"](_header("imu_link"), _MARK, 0.0)
