"""Whole topics decoded at once.

Every message of these types has the same bytes at the same places as long as its strings and sequences keep their
lengths, which they do within a topic. So the layout is taken from the first message, checked against all others (the
bytes that carry lengths must be equal), and numpy reads the joined payloads as one structured array. Where the check
fails, `rosbags`' deserializer reads message by message.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from .layout import LAYOUTS, Layout, carriage

FloatArray = NDArray[np.float64]
Columns = dict[str, FloatArray]
"""Field name -> (n,) or (n, k)."""


@dataclass
class Decoded:
    """The fields of a topic: header stamps and the type's columns."""

    stamp_ns: NDArray[np.int64]
    columns: Columns
    frame_id: str = ""
    """Of the first message."""


RIG_STATE = "gsense_msgs/msg/RigState"
RIG_STATE_DEFINITION = """\
std_msgs/Header header
uint8 mode
bool[4] switches
uint8 light
float64 duty
float64 current
float64 reference
float64 tracking_error
uint8 fault
string fault_text
"""


def decode(msgtype: str, payloads: list[bytes]) -> Decoded:
    """Decode all messages of a topic.

    Args:
        msgtype: one of the types of `LAYOUTS`.
        payloads: CDR messages with their encapsulation, at least one.

    Raises:
        ValueError: a message that is not of this type (too short, broken lengths).
    """
    fast = _decode_fixed(msgtype, payloads)
    return fast if fast is not None else decode_slow(msgtype, payloads)


def _decode_fixed(msgtype: str, payloads: list[bytes]) -> Decoded | None:
    first = payloads[0]
    size = len(first)
    joined = b"".join(payloads)
    if len(joined) != size * len(payloads) or set(map(len, payloads)) != {size}:
        return None
    layout = Layout(first, "<" if first[1] & 1 else ">")
    try:
        frame_id = layout.header()
        LAYOUTS[msgtype](layout)
    except (ValueError, struct.error):
        return None
    if layout.at > size:
        return None
    table = np.frombuffer(joined, np.uint8).reshape(len(payloads), size)
    fixed = [*range(4), *(at + i for at in layout.lengths for i in range(4))]
    if not np.array_equal(table[:, fixed], np.broadcast_to(table[0, fixed], (len(payloads), len(fixed)))):
        return None
    spec: Any = {"names": layout.names, "formats": layout.formats, "offsets": layout.offsets, "itemsize": size}
    rows = np.frombuffer(joined, np.dtype(spec))
    stamp = rows["sec"].astype(np.int64) * 1_000_000_000 + rows["nanosec"]
    names = [name for name in layout.names if name not in ("sec", "nanosec")]
    return Decoded(stamp, {name: _column(rows[name], name) for name in names}, frame_id)


def _column(values: FloatArray, name: str) -> FloatArray:
    """A copy of its own; covariances, of which only an element is looked at, stay where they are."""
    if name.endswith("_covariance") and values.dtype == np.float64:
        return values
    return np.ascontiguousarray(values, dtype=np.float64)


@lru_cache(maxsize=1)
def _typestore() -> Typestore:
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(RIG_STATE_DEFINITION, RIG_STATE))
    return store


def decode_slow(msgtype: str, payloads: list[bytes]) -> Decoded:
    """The same as `decode`, message by message with `rosbags`; the oracle of the fast way.

    Raises:
        ValueError: a message that is not of this type.
    """
    stamps: list[int] = []
    rows: list[dict[str, Any]] = []
    frames: list[str] = []
    for payload in payloads:
        try:
            message: Any = _typestore().deserialize_cdr(payload, msgtype)
            rows.append(_SLOW[msgtype](message))
        except Exception as error:  # the generated deserializers raise whatever struct and numpy raise
            raise ValueError(f"message {len(rows)} is not a {msgtype}") from error
        stamps.append(message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec)
        frames.append(message.header.frame_id)
    columns = {name: np.array([row.get(name, np.nan) for row in rows], dtype=np.float64) for name in _names(rows)}
    return Decoded(np.array(stamps, dtype=np.int64), columns, frames[0] if frames else "")


def _names(rows: list[dict[str, Any]]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))


def _slow_imu(m: Any) -> dict[str, Any]:
    return {
        "orientation": [m.orientation.x, m.orientation.y, m.orientation.z, m.orientation.w],
        "orientation_covariance": m.orientation_covariance,
        "angular_velocity": _xyz(m.angular_velocity),
        "angular_velocity_covariance": m.angular_velocity_covariance,
        "linear_acceleration": _xyz(m.linear_acceleration),
        "linear_acceleration_covariance": m.linear_acceleration_covariance,
    }


def _slow_pose(m: Any) -> dict[str, Any]:
    turn = m.pose.orientation
    return {"position": _xyz(m.pose.position), "orientation": [turn.x, turn.y, turn.z, turn.w]}


def _slow_joint(m: Any) -> dict[str, Any]:
    index = carriage(list(m.name))
    values = {name: getattr(m, name) for name in ("position", "velocity", "effort")}
    return {name: value[index] for name, value in values.items() if index < len(value)}


def _xyz(vector: Any) -> list[float]:
    return [vector.x, vector.y, vector.z]


_SLOW: dict[str, Callable[[Any], dict[str, Any]]] = {
    "sensor_msgs/msg/Imu": _slow_imu,
    "geometry_msgs/msg/PoseStamped": _slow_pose,
    "sensor_msgs/msg/MagneticField": lambda m: {"magnetic_field": _xyz(m.magnetic_field)},
    "sensor_msgs/msg/Temperature": lambda m: {"temperature": m.temperature},
    "sensor_msgs/msg/BatteryState": lambda m: {"voltage": m.voltage},
    "sensor_msgs/msg/JointState": _slow_joint,
    RIG_STATE: lambda m: {"duty": m.duty, "current": m.current},
}

LINK_STATUS = "gsense_msgs/msg/LinkStatus"
_LINK_DEFINITION = """\
std_msgs/Header header
uint64 received
uint64 lost
uint64 corrupt
uint64 duplicate
uint64 reordered
uint32 restarts
float64 rate_hz
float64 clock_offset_s
float64 clock_skew_ppm
float64 uptime_s
"""


def decode_link(payloads: list[bytes], definition: str) -> list[Any]:
    """LinkStatus messages by the definition stored in the bag (fields may have been added), else by the contract's.

    Raises:
        ValueError: a message that the definition does not describe.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    try:
        types = get_types_from_msg(definition.split("=" * 80, maxsplit=1)[0] or _LINK_DEFINITION, LINK_STATUS)
        store.register({LINK_STATUS: types[LINK_STATUS]})
        return [store.deserialize_cdr(payload, LINK_STATUS) for payload in payloads]
    except Exception as error:
        raise ValueError(f"not a {LINK_STATUS} ({' '.join(str(error).split())})") from error
