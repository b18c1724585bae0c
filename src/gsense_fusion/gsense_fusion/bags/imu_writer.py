"""A bag of Imu topics, complete or not at all."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from .imu_message import FloatArray, IntArray, build_many
from .topics import IMU


def write_imu_bag(
    path: Path, stamp_ns: IntArray, received_ns: IntArray, frame: str, topics: Mapping[str, FloatArray]
) -> None:
    """Write topics of common stamps as an MCAP bag; a bag that was there is replaced.

    Args:
        path: folder of the bag; its parent exists.
        stamp_ns: header stamps, shape (n,).
        received_ns: times of the messages in the bag, shape (n,).
        frame: `header.frame_id`.
        topics: name -> the 37 numbers of each message (`ImuMessage.values`), shape (n, 37).

    Raises:
        OSError: the folder is not writable.
    """
    beside = path.with_name(f".{path.name}.partial")
    shutil.rmtree(beside, ignore_errors=True)
    beside.mkdir()
    partial = beside / path.name
    store = get_typestore(Stores.ROS2_JAZZY)
    try:
        with Writer(partial, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            connections = [writer.add_connection(name, IMU, typestore=store) for name in topics]
            times = received_ns.tolist()
            messages = [build_many(stamp_ns, frame, numbers) for numbers in topics.values()]
            for i, when in enumerate(times):
                for connection, rows in zip(connections, messages, strict=True):
                    writer.write(connection, when, rows[i])
        _rename_files(partial, path.name)
        shutil.rmtree(path, ignore_errors=True)
        partial.rename(path)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _rename_files(folder: Path, name: str) -> None:
    """Storage files as `ros2 bag` names them: `bag.mcap` -> `bag_0.mcap`, in metadata.yaml too."""
    metadata = folder / "metadata.yaml"
    text = metadata.read_text(encoding="utf-8")
    for number, file in enumerate(sorted(folder.glob("*.mcap"))):
        new = f"{name}_{number}{file.suffix}"
        text = text.replace(file.name, new)
        file.rename(folder / new)
    metadata.write_text(text, encoding="utf-8")
