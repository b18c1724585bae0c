"""Batch serialisation against the library, message by message."""

from __future__ import annotations

import numpy as np

from gsense_rig.recording.cdr import Template
from gsense_rig.recording.typestore import typestore

STORE = typestore()
TYPES = STORE.types


def header(sec: int, nanosec: int, frame: str) -> object:
    return TYPES["std_msgs/msg/Header"](TYPES["builtin_interfaces/msg/Time"](sec, nanosec), frame)


def joint_state(sec: int, nanosec: int, value: float) -> object:
    return TYPES["sensor_msgs/msg/JointState"](
        header(sec, nanosec, "rail"), ["carriage"], np.array([value]), np.array([2 * value]), np.zeros(0)
    )


def rig_state(sec: int, nanosec: int, value: float) -> object:
    return TYPES["gsense_msgs/msg/RigState"](
        header(sec, nanosec, "odd"),
        int(value),
        np.array([True, False, value > 3, False]),
        2,
        value / 10,
        0.0,
        -value,
        0.5,
        7,
        "text",
    )


def test_every_copy_is_what_the_library_writes() -> None:
    """Strings, sequences, booleans and the alignment of what follows them."""
    values = np.arange(1.0, 6.0)
    stamps = np.array([1_700_000_000_999_999_999, 5, 1_000_000_000, 2_147_483_647_000_000_001, 77], dtype=np.int64)
    cases = [
        (joint_state, {"position.0": values, "velocity.0": 2 * values}),
        (
            rig_state,
            {
                "mode": values,
                "switches.2": values > 3,
                "duty": values / 10,
                "tracking_error": 0.5,
                "reference": -values,
            },
        ),
    ]
    for make, fields in cases:
        template = Template(STORE, make(0, 0, 1.0))
        blobs = template.fill(stamps, fields)
        for stamp, value, blob in zip(stamps.tolist(), values, blobs, strict=True):
            expected = make(stamp // 10**9, stamp % 10**9, float(value))
            assert blob.tobytes() == bytes(STORE.serialize_cdr(expected, template.msgtype))
