"""Where the fields of a message lie in its bytes, as its first message tells.

CDR (OMG DDS-XTypes, plain CDR version 1): 4 bytes of encapsulation, whose second byte is 1 for little-endian; then each
primitive aligned to its own size, counted from behind the encapsulation; strings as u32 length with the closing NUL.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Layout:
    """Where the wanted fields of one message lie, and which bytes carry lengths."""

    data: bytes
    order: str = "<"
    at: int = 4
    names: list[str] = field(default_factory=list)
    formats: list[Any] = field(default_factory=list)
    offsets: list[int] = field(default_factory=list)
    lengths: list[int] = field(default_factory=list)

    def align(self, size: int) -> None:
        """Go on to a multiple of a primitive's size."""
        self.at += -(self.at - 4) % size

    def length(self) -> int:
        """A u32 that decides about the bytes behind it."""
        self.align(4)
        self.lengths.append(self.at)
        (value,) = struct.unpack_from(self.order + "I", self.data, self.at)
        self.at += 4
        return int(value)

    def string(self) -> bytes:
        """Its bytes without the closing NUL.

        Raises:
            ValueError: the message is shorter.
        """
        size = self.length()
        if self.at + size > len(self.data):
            raise ValueError("string runs over the end of the message")
        text = self.data[self.at : self.at + size].rstrip(b"\0")
        self.at += size
        return text

    def take(self, name: str, code: str, count: int = 1) -> None:
        """A field of `count` numbers, their type in numpy's code without the byte order."""
        size = int(code[1:])
        self.align(size)
        self.names.append(name)
        self.formats.append((self.order + code, (count,)) if count > 1 else self.order + code)
        self.offsets.append(self.at)
        self.at += size * count

    def header(self) -> str:
        """Stamp and frame; the frame's name."""
        self.take("sec", "i4")
        self.take("nanosec", "u4")
        return self.string().decode(errors="replace")


def _imu(layout: Layout) -> None:
    for name, count in (
        ("orientation", 4),
        ("orientation_covariance", 9),
        ("angular_velocity", 3),
        ("angular_velocity_covariance", 9),
        ("linear_acceleration", 3),
        ("linear_acceleration_covariance", 9),
    ):
        layout.take(name, "f8", count)


def _pose(layout: Layout) -> None:
    layout.take("position", "f8", 3)
    layout.take("orientation", "f8", 4)


def _mag(layout: Layout) -> None:
    layout.take("magnetic_field", "f8", 3)


def _temperature(layout: Layout) -> None:
    layout.take("temperature", "f8")


def _battery(layout: Layout) -> None:
    layout.take("voltage", "f4")


def _joint(layout: Layout) -> None:
    names = [layout.string() for _ in range(layout.length())]
    index = carriage([name.decode(errors="replace") for name in names])
    for quantity in ("position", "velocity", "effort"):
        count = layout.length()
        if count:
            layout.align(8)
            start = layout.at
            if index < count:
                layout.at = start + 8 * index
                layout.take(quantity, "f8")
            layout.at = start + 8 * count


def _rig_state(layout: Layout) -> None:
    layout.at += 6  # mode, four switches, light
    layout.take("duty", "f8")
    layout.take("current", "f8")


def carriage(names: list[str]) -> int:
    """Which joint is the carriage: the one of that name, else the first."""
    return names.index("carriage") if "carriage" in names else 0


LAYOUTS: dict[str, Callable[[Layout], None]] = {
    "sensor_msgs/msg/Imu": _imu,
    "geometry_msgs/msg/PoseStamped": _pose,
    "sensor_msgs/msg/MagneticField": _mag,
    "sensor_msgs/msg/Temperature": _temperature,
    "sensor_msgs/msg/BatteryState": _battery,
    "sensor_msgs/msg/JointState": _joint,
    "gsense_msgs/msg/RigState": _rig_state,
}
