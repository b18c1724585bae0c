"""A rosbag2 bag in MCAP with the names that rosbag2's own tools expect: DIR/<bag>_<n>.mcap and DIR/metadata.yaml."""

from __future__ import annotations

import errno
import os
from pathlib import Path
from typing import Any, ClassVar, Final

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer

from gsense_rig.recording.mcap_file import CHUNK, Block, McapFile
from gsense_rig.recording.metadata import VERSION, BagInformation, FilePart

RESERVE: Final = 4 * CHUNK
"""Bytes kept free for closing a bag on a full disk: the chunk in hand, the index, metadata.yaml."""
RESERVE_FILE: Final = ".reserve"
_FOREVER = QosTime(9223372036, 854775807)


class BagWriter(Writer):
    """`rosbags`' writer: MCAP, version 9, split by size. Raises `rosbags.rosbag2.WriterError` where the folder exists.

    Args:
        path: the bag's folder.
        max_bytes: size at which the next storage file is begun; 0: never.
    """

    STORAGE_PLUGINS: ClassVar[Any] = {StoragePlugin.MCAP: lambda path, _: McapFile(storage_file(path))}  # type: ignore[misc]

    def __init__(self, path: Path, max_bytes: int = 0) -> None:
        super().__init__(path, version=VERSION, storage_plugin=StoragePlugin.MCAP)
        self._max_bytes = max_bytes
        self._parts: list[FilePart] = []

    @property
    def total(self) -> int:
        """Messages written so far."""
        return sum(self.counts.values())

    def write(self, connection: Connection, timestamp: int, data: bytes | memoryview) -> None:
        """As the library's. Where this raises OSError the message is in the chunk in hand, so it counts."""
        try:
            super().write(connection, timestamp, data)
        except OSError:
            self.counts[connection.id] += 1
            raise
        self._split_where_due()

    def write_block(self, block: Block) -> None:
        """Writes many messages at once; their channels are the ids of connections."""
        before = dict(self._file.channel_stats)
        self._file.write_block(block)
        for channel, count in self._file.channel_stats.items():
            self.counts[channel] += count - before.get(channel, 0)
        self._split_where_due()

    def flush(self) -> None:
        """Puts what has been written so far on disk; a killed process loses only what came later.

        Raises:
            OSError: the disk is full, or the file is no longer in its folder.
        """
        if not self._file.path.exists():
            raise FileNotFoundError(errno.ENOENT, "its file is gone, the bag was moved or removed")
        if self._file.chunk.bio.tell():
            self._file.close_chunk()

    def reserve(self) -> None:
        """Takes the room that closing the bag will need, while there is some."""
        with (self.path / RESERVE_FILE).open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, RESERVE)

    def close(self) -> None:
        """Writes index and metadata.yaml; a reserve makes that possible on a full disk too."""
        (self.path / RESERVE_FILE).unlink(missing_ok=True)
        if self.storage is not None:
            self._close_file()
        BagInformation(self._parts, self.connections, self.counts, self.custom_data).write(self.path)

    @property
    def _file(self) -> McapFile:
        storage = self.storage
        assert isinstance(storage, McapFile)  # noqa: S101 - `open` makes nothing else
        return storage

    def _split_where_due(self) -> None:
        """The next file, where this one is large enough; it can be read without the others."""
        if not self._max_bytes or self._file.size < self._max_bytes:
            return
        announced = self._file.announced
        self._close_file()
        following = McapFile(storage_file(self.path, len(self._parts)))
        for connection, qos in announced:
            following.add_connection(connection, qos)
        self.storage = following

    def _close_file(self) -> None:
        file = self._file
        part = FilePart(file.path.name, file.message_start_time, file.message_end_time, file.count)
        file.close(VERSION, BagInformation([part], self.connections, file.channel_stats, {}).text())
        self._parts.append(part)
        self.storage = None


def storage_file(bag: Path, number: int = 0) -> Path:
    """The storage file of that number of a bag that `BagWriter` has written."""
    return bag / f"{bag.name}_{number}.mcap"


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
