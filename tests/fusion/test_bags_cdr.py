"""The decoder of whole topics equals the library's, message by message."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

from gsense_fusion.bags import cdr
from gsense_fusion.bags.layout import LAYOUTS

from .bag_data import START_NS, STORE, header, imu, message, quaternion, vector

RNG = np.random.default_rng(7)
KINDS = sorted(LAYOUTS)


def _random(kind: str, frame: str, joints: int) -> Any:
    stamp = START_NS + int(RNG.integers(0, 10**12))
    if kind.endswith("/Imu"):
        fields = {"angular_velocity_covariance": RNG.normal(size=9)}
        return imu(stamp, RNG.normal(size=3), RNG.normal(size=3), frame, **fields)
    if kind.endswith("/PoseStamped"):
        point = message("geometry_msgs/msg/Point", x=RNG.normal(), y=RNG.normal(), z=RNG.normal())
        pose = message("geometry_msgs/msg/Pose", position=point, orientation=quaternion(RNG.normal(size=4)))
        return message(kind, header=header(stamp, frame), pose=pose)
    if kind.endswith("/MagneticField"):
        return message(kind, header=header(stamp, frame), magnetic_field=vector(RNG.normal(size=3)))
    if kind.endswith("/JointState"):
        names = [f"joint{i}" for i in range(joints - 1)] + ["carriage"]
        values = {"position": RNG.normal(size=joints), "velocity": RNG.normal(size=joints)}
        return message(kind, header=header(stamp, frame), name=names, **values)
    if kind.endswith("/RigState"):
        text = "stall" if joints > 1 else ""
        return message(kind, header=header(stamp, frame), duty=RNG.normal(), current=RNG.normal(), fault_text=text)
    quantity = "temperature" if kind.endswith("/Temperature") else "voltage"
    return message(kind, header=header(stamp, frame), **{quantity: float(np.float32(RNG.normal()))})


@pytest.mark.parametrize("frame", ["", "i", "imu", "imu_link", "rail", "a_longer_frame_of_the_board"])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("little", [True, False])
def test_equal_to_the_library(kind: str, frame: str, little: bool) -> None:
    messages = [_random(kind, frame, joints=1 + len(frame) % 3) for _ in range(20)]
    payloads = [bytes(STORE.serialize_cdr(m, kind, little_endian=little)) for m in messages]
    fast = cdr._decode_fixed(kind, payloads)
    assert fast is not None, "the layout of one topic is constant, so the fast way must take it"
    slow = cdr.decode_slow(kind, payloads)
    np.testing.assert_array_equal(fast.stamp_ns, slow.stamp_ns)
    assert fast.columns.keys() == slow.columns.keys()
    for name, values in slow.columns.items():
        np.testing.assert_array_equal(fast.columns[name], values)


def test_equal_length_with_other_strings_inside_is_not_taken_for_constant() -> None:
    kind = "sensor_msgs/msg/Imu"  # frames of 2 and 3 letters pad to the same message length
    frames = ["ab", "abc", "ab", "abc"]
    messages = [imu(START_NS + i, (i, 0, 0), (0, 0, 9.8), frame) for i, frame in enumerate(frames)]
    payloads = [bytes(get_typestore(Stores.ROS2_JAZZY).serialize_cdr(m, kind)) for m in messages]
    assert len({len(payload) for payload in payloads}) == 1
    assert cdr._decode_fixed(kind, payloads) is None
    np.testing.assert_array_equal(cdr.decode(kind, payloads).columns["angular_velocity"][:, 0], [0, 1, 2, 3])


def test_broken_payload_is_an_error_not_a_crash() -> None:
    with pytest.raises(ValueError, match="is not a sensor_msgs/msg/Imu"):
        cdr.decode("sensor_msgs/msg/Imu", [b"\0\1\0\0" + b"\xff" * 40])
