"""What a picture of a run shows, as arrays out of its bag."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag2 import ReaderError
from rosbags.typesys.store import Typestore

Array = npt.NDArray[np.float64]


class RunError(ValueError):
    """The bag cannot be shown; the message is one line."""


@dataclass(frozen=True)
class RunColumns:
    """One run; times in s since its first encoder pose, axes as the messages have them."""

    name: str
    sensor: str
    pose: Array
    """(n, 2): time, position (m)."""
    state: Array
    """(m, 3): time, reference (m), tracking error (m)."""
    imu: Array
    """(k, 7): time, angular rate (rad/s), specific force (m/s^2)."""


def read_columns(bag: Path, sensor: str, store: Typestore) -> RunColumns:
    """Reads a closed bag, ours or rosbag2's.

    Raises:
        RunError: not a bag, or a topic is missing.
    """
    takers: dict[str, Callable[[Any], tuple[float, ...]]] = {
        "rig/pose": lambda m: (m.pose.position.x,),
        "rig/state": lambda m: (m.reference, m.tracking_error),
        f"{sensor}/imu/data_raw": lambda m: (*_xyz(m.angular_velocity), *_xyz(m.linear_acceleration)),
    }
    rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in takers}
    if not bag.exists():
        raise RunError(f"{bag}: no such bag")
    try:
        with AnyReader([bag], default_typestore=store) as reader:
            wanted = {c.id: name for c in reader.connections for name in takers if c.topic.endswith(f"/{name}")}
            for connection, _, raw in reader.messages([c for c in reader.connections if c.id in wanted]):
                m: Any = reader.deserialize(raw, connection.msgtype)
                name = wanted[connection.id]
                stamp = (m.header.stamp.sec, m.header.stamp.nanosec * 1e-9)
                rows[name].append((*stamp, *takers[name](m)))
    except (AnyReaderError, ReaderError, OSError) as error:
        raise RunError(f"{bag}: {' '.join(str(error).split())}; a killed recorder's bag: record --repair") from error
    empty = [name for name, found in rows.items() if not found]
    if empty:
        raise RunError(f"{bag}: no messages on {', '.join(empty)}")
    pose, state, imu = (np.array(rows[name]) for name in takers)
    origin = pose[0, :2].copy()
    return RunColumns(bag.resolve().name, sensor, *(_with_time(table, origin) for table in (pose, state, imu)))


def _with_time(table: Array, origin: Array) -> Array:
    time = (table[:, 0] - origin[0]) + (table[:, 1] - origin[1])
    return np.column_stack([time, table[:, 2:]])


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z
