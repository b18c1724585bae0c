"""`sensor_msgs/Imu` as CDR bytes, one or many, both ways.

For bags, and for the live node, which so spares the conversion into Python objects and back. Layout: see `cdr`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_HEAD = struct.Struct("<4siII")
_BODY = struct.Struct("<37d")
_THREE, _FOUR, _NINE = struct.Struct("<3d"), struct.Struct("<4d"), struct.Struct("<9d")
_LITTLE_ENDIAN = b"\x00\x01\x00\x00"
UNREPORTED = (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@dataclass(slots=True)
class ImuMessage:
    """The fields of one message. Not frozen: made for each sample, and frozen ones take four times as long."""

    stamp_ns: int
    frame: bytes
    """`header.frame_id`, with its closing NUL."""
    values: tuple[float, ...]
    """Orientation x, y, z, w and covariance (9), angular velocity and covariance, acceleration and covariance."""
    data: bytes
    """The message itself."""
    start: int
    """Where in it the values are."""

    @property
    def rate(self) -> tuple[float, ...]:
        """Angular velocity, rad/s."""
        return self.values[13:16]

    @property
    def rate_covariance(self) -> tuple[float, ...]:
        """Of the angular velocity, 9 numbers."""
        return self.values[16:25]

    @property
    def force(self) -> tuple[float, ...]:
        """Linear acceleration (specific force), m/s^2."""
        return self.values[25:28]

    @property
    def force_covariance(self) -> tuple[float, ...]:
        """Of the linear acceleration, 9 numbers."""
        return self.values[28:37]


def parse_imu(data: bytes) -> ImuMessage:
    """Read one message.

    Raises:
        ValueError: not a little-endian Imu.
    """
    try:
        encapsulation, sec, nanosec, size = _HEAD.unpack_from(data)
        start = 16 + size
        values = _BODY.unpack_from(data, start + -(start - 4) % 8)
    except struct.error as error:
        raise ValueError("not a sensor_msgs/Imu") from error
    if encapsulation[1] != 1:
        raise ValueError("not in little-endian CDR")
    at = start + -(start - 4) % 8
    return ImuMessage(sec * 1_000_000_000 + nanosec, data[16:start], values, data, at)


def with_attitude(message: ImuMessage, quaternion: list[float], covariance: bytes, rate: list[float]) -> bytes:
    """The message with another orientation and angular velocity; all else stays, so only a seventh is written anew.

    Args:
        message: as it was received.
        quaternion: w, x, y, z.
        covariance: of the orientation, from `packed`.
        rate: angular velocity, rad/s.
    """
    w, x, y, z = quaternion
    data, at = message.data, message.start
    parts = (data[:at], _FOUR.pack(x, y, z, w), covariance, _THREE.pack(*rate), data[at + 128 : at + _BODY.size])
    return b"".join(parts)


def packed(numbers: Iterable[float]) -> bytes:
    """Nine numbers of a covariance, as they stand in a message."""
    return _NINE.pack(*numbers)


def _prefix(frame: bytes) -> bytes:
    """All up to the numbers, with a stamp of zero."""
    head = _HEAD.pack(_LITTLE_ENDIAN, 0, 0, len(frame)) + frame
    return head + bytes(-(len(head) - 4) % 8)


def build_imu(stamp_ns: int, frame: bytes, *numbers: float) -> bytes:
    """Write one message; `frame` with its NUL, the 37 numbers as in `ImuMessage.values`."""
    sec, nanosec = divmod(stamp_ns, 1_000_000_000)
    head = _HEAD.pack(_LITTLE_ENDIAN, sec, nanosec, len(frame)) + frame
    return head + bytes(-(len(head) - 4) % 8) + _BODY.pack(*numbers)


def build_many(stamp_ns: IntArray, frame: str, numbers: FloatArray) -> list[bytes]:
    """Write n messages; `numbers` of shape (n, 37)."""
    prefix = _prefix(frame.encode() + b"\0")
    size = len(prefix) + _BODY.size
    table = np.empty((len(stamp_ns), size), dtype=np.uint8)
    table[:, : len(prefix)] = np.frombuffer(prefix, np.uint8)
    stamps = np.stack(np.divmod(stamp_ns, 1_000_000_000), axis=1).astype("<i4")
    table[:, 4:12] = stamps.view(np.uint8).reshape(-1, 8)
    table[:, len(prefix) :] = np.ascontiguousarray(numbers, dtype="<f8").view(np.uint8).reshape(len(stamp_ns), -1)
    joined = table.tobytes()
    return [joined[i : i + size] for i in range(0, len(joined), size)]
