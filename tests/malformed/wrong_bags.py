"""Bags that are whole, and wrong in what they say: stamps, values, types, definitions, payloads."""

from __future__ import annotations

import random
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from tests.fusion.bag_data import START_NS, STORE, header, imu, message, quaternion

TOPIC = "/mpu6050/imu/data_raw"
VALUES = (float("nan"), float("inf"), -float("inf"), 1e308, -1e300, 5e-324, 0.0, 1e9)
KINDS = (
    "no_messages",
    "one_message",
    "two_messages",
    "values",
    "constant",
    "same_stamp",
    "backwards",
    "shuffled",
    "years_apart",
    "negative_stamp",
    "zero_stamp",
    "short_payload",
    "long_payload",
    "random_payload",
    "empty_payload",
    "wrong_type",
    "wrong_definition",
    "pose_nan",
    "pose_elsewhere",
    "joint_empty",
    "joint_ragged",
    "huge_rate",
    "bad_nanoseconds",
)


def write_wrong(path: Path, kind: str, draw: random.Random) -> None:
    """A bag in a folder, MCAP or SQLite3, 6 s at 100 Hz before it was made wrong."""
    rows = [(START_NS + 10_000_000 * i, _imu(i), _pose(i)) for i in range(600)]
    counts = {"no_messages": 0, "one_message": 1, "two_messages": 2}
    rows = rows[: counts.get(kind, len(rows))]
    data = [(at, _serialised(kind, i, at, m, draw), _other(kind, at, p, draw)) for i, (at, m, p) in enumerate(rows)]
    if kind == "shuffled":
        draw.shuffle(data)
    elif kind == "backwards":
        data.reverse()
    storage = draw.choice((StoragePlugin.MCAP, StoragePlugin.SQLITE3))
    with Writer(path, version=9, storage_plugin=storage) as writer:
        imu_type = "sensor_msgs/msg/Temperature" if kind == "wrong_type" else "sensor_msgs/msg/Imu"
        first = writer.add_connection(TOPIC, imu_type, typestore=STORE, **_definition(kind, draw))
        joint = kind.startswith("joint")
        other_type = "sensor_msgs/msg/JointState" if joint else "geometry_msgs/msg/PoseStamped"
        second = writer.add_connection("/rig/joint_states" if joint else "/rig/pose", other_type, typestore=STORE)
        for at, one, other in data:
            writer.write(first, max(at, 0), one)
            writer.write(second, max(at, 0), other)


def _definition(kind: str, draw: random.Random) -> dict[str, Any]:
    if kind != "wrong_definition":
        return {}
    text = draw.choice(["", "float64 x\n", "nonsense (", "std_msgs/Header header\nstring[] angular_velocity\n", "\x00"])
    return {"msgdef": text, "rihs01": "RIHS01_" + "0" * 64}


def _imu(i: int) -> Any:
    return imu(START_NS + 10_000_000 * i, (0.01, 0.0, 0.001 * (i % 7)), (0.1, 0.0, 9.81))


def _pose(i: int) -> float:
    return 0.15 * float(np.sin(0.03 * i))


def _serialised(kind: str, i: int, at: int, content: Any, draw: random.Random) -> bytes:
    if kind == "values" and draw.random() < 0.2:
        getattr(content, draw.choice(("angular_velocity", "linear_acceleration"))).x = draw.choice(VALUES)
    elif kind == "constant":
        content.angular_velocity.z = content.linear_acceleration.x = 0.0
    elif kind == "huge_rate":
        content.angular_velocity.z = 1e200 * (i % 5)
    stamps = {
        "same_stamp": START_NS,
        "years_apart": START_NS + min(i, 100) * 3 * 10**15,
        "negative_stamp": -(10**18) + i * 10**7,
        "zero_stamp": 0,
    }
    if kind in stamps:
        content.header = header(stamps[kind])
    elif kind == "bad_nanoseconds" and i % 3 == 0:
        content.header.stamp.nanosec = 4_294_967_295
    if kind == "wrong_type":
        return bytes(
            STORE.serialize_cdr(
                message("sensor_msgs/msg/Temperature", header=header(at)), "sensor_msgs/msg/Temperature"
            )
        )
    data = bytes(STORE.serialize_cdr(content, "sensor_msgs/msg/Imu"))
    if kind in ("short_payload", "long_payload", "random_payload", "empty_payload") and draw.random() < 0.3:
        return {
            "short_payload": data[: draw.randrange(len(data))],
            "long_payload": data + draw.randbytes(9),
            "random_payload": draw.randbytes(len(data)),
            "empty_payload": b"",
        }[kind]
    return data


def _other(kind: str, at: int, x: float, draw: random.Random) -> bytes:
    if kind.startswith("joint"):
        names = [] if kind == "joint_empty" else ["carriage", "other"][: draw.randrange(3)]
        lists = {
            n: np.zeros(0 if kind == "joint_empty" else draw.randrange(3)) for n in ("position", "velocity", "effort")
        }
        joint = message("sensor_msgs/msg/JointState", header=header(at, ""), name=names, **lists)
        return bytes(STORE.serialize_cdr(joint, "sensor_msgs/msg/JointState"))
    x = draw.choice(VALUES) if kind == "pose_nan" and draw.random() < 0.2 else x
    at = at + 10**15 if kind == "pose_elsewhere" else at
    position = message("geometry_msgs/msg/Point", x=x)
    pose = message("geometry_msgs/msg/Pose", position=position, orientation=quaternion((1, 0, 0, 0)))
    stamped = message("geometry_msgs/msg/PoseStamped", header=header(at, "rail"), pose=pose)
    return bytes(STORE.serialize_cdr(stamped, "geometry_msgs/msg/PoseStamped"))
