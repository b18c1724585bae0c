"""A rosbag2 bag in MCAP with the names that rosbag2's own tools expect: DIR/<bag>_0.mcap and DIR/metadata.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.storage_mcap import McapWriter

VERSION = 9
_FOREVER = QosTime(9223372036, 854775807)


class _NumberedMcap(McapWriter):
    """The library names the file <bag>.mcap; `ros2 bag reindex` wants <bag>_0.mcap."""

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        self.path = self.path.rename(path / f"{path.name}_0.mcap")


class BagWriter(Writer):
    """`rosbags`' writer, MCAP, version 9. Raises `rosbags.rosbag2.WriterError` where the folder exists."""

    STORAGE_PLUGINS: ClassVar[Mapping[StoragePlugin, type]] = {StoragePlugin.MCAP: _NumberedMcap}

    def __init__(self, path: Path) -> None:
        super().__init__(path, version=VERSION, storage_plugin=StoragePlugin.MCAP)

    @property
    def total(self) -> int:
        """Messages written so far."""
        return sum(self.counts.values())


def storage_file(bag: Path) -> Path:
    """The one storage file of a bag that `BagWriter` has written."""
    return bag / f"{bag.name}_0.mcap"


def offered_qos(depth: int, *, reliable: bool = True, transient: bool = False) -> Qos:
    """A publisher's QoS as it stands in metadata.yaml."""
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=depth,
        reliability=QosReliability.RELIABLE if reliable else QosReliability.BEST_EFFORT,
        durability=QosDurability.TRANSIENT_LOCAL if transient else QosDurability.VOLATILE,
        deadline=_FOREVER,
        lifespan=_FOREVER,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=_FOREVER,
        avoid_ros_namespace_conventions=False,
    )
