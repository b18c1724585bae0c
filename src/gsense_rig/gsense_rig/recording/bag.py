"""A rosbag2 bag in MCAP with the names that rosbag2's own tools expect: DIR/<bag>_0.mcap and DIR/metadata.yaml."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from struct import Struct
from typing import ClassVar, Final

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
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.storage_mcap import McapWriter

VERSION: Final = 9
CHUNK = 1 << 20
"""Bytes after which a chunk goes to disk."""
RESERVE = 4 * CHUNK
"""Bytes kept free for closing a bag on a full disk: the chunk in hand, the index, metadata.yaml."""
_RESERVE_FILE = ".reserve"
_FOREVER = QosTime(9223372036, 854775807)
_MESSAGE = Struct("<BQHIQQ")
"""MCAP record 0x05: opcode, length, channel, sequence, log time, publish time; the data follow."""
_MESSAGE_FIXED = _MESSAGE.size - 9


class _WholeFile:
    """An unbuffered file whose `write` writes all or raises, so that a failed write can be taken back."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def write(self, data: bytes | memoryview) -> int:
        left = memoryview(data).cast("B")
        while left.nbytes:
            left = left[os.write(self._descriptor, left) :]
        return memoryview(data).nbytes

    def tell(self) -> int:
        return os.lseek(self._descriptor, 0, os.SEEK_CUR)

    def take_back(self, position: int) -> None:
        os.ftruncate(self._descriptor, position)
        os.lseek(self._descriptor, position, os.SEEK_SET)

    def close(self) -> None:
        os.close(self._descriptor)


class _NumberedMcap(McapWriter):
    """The library names the file <bag>.mcap; `ros2 bag reindex` wants <bag>_0.mcap."""

    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        self.path = self.path.rename(path / f"{path.name}_0.mcap")
        descriptor = os.dup(self.bio.fileno())
        self.bio.close()  # flushes what the library has written so far
        self.bio = _WholeFile(descriptor)  # type: ignore[assignment]

    def close_chunk(self) -> None:
        """As the library's; where the disk is full the file ends as before, and the chunk is still in hand."""
        start = self.bio.tell()
        try:
            super().close_chunk()
        except OSError:
            self.bio.take_back(start)  # type: ignore[attr-defined]
            raise

    def write_sorted(self, messages: Iterable[tuple[int, int, bytes]]) -> None:
        """Writes (connection id, time, data) whose times do not fall; several times faster than one by one."""
        chunk, pack = self.chunk, _MESSAGE.pack
        at = chunk.bio.tell()
        parts: list[bytes] = []
        first = last = None
        for channel, time, data in messages:
            parts.append(pack(0x05, _MESSAGE_FIXED + len(data), channel, 0, time, time))
            parts.append(data)
            chunk.msgs[channel].append((time, at))
            at += _MESSAGE.size + len(data)
            self.channel_stats[channel] += 1
            first = time if first is None else first
            last = time
        if first is None or last is None:
            return
        chunk.bio.write(b"".join(parts))
        chunk.message_start_time = min(first, chunk.message_start_time)
        chunk.message_end_time = max(last, chunk.message_end_time)
        self.message_start_time = min(first, self.message_start_time)
        self.message_end_time = max(last, self.message_end_time)
        if at > CHUNK:
            self.close_chunk()


class BagWriter(Writer):
    """`rosbags`' writer, MCAP, version 9. Raises `rosbags.rosbag2.WriterError` where the folder exists."""

    STORAGE_PLUGINS: ClassVar[Mapping[StoragePlugin, type]] = {StoragePlugin.MCAP: _NumberedMcap}  # type: ignore[misc]

    def __init__(self, path: Path) -> None:
        super().__init__(path, version=VERSION, storage_plugin=StoragePlugin.MCAP)

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
            self.min_timestamp = min(timestamp, self.min_timestamp)
            self.max_timestamp = max(timestamp, self.max_timestamp)
            raise

    def write_sorted(self, messages: list[tuple[Connection, int, bytes]]) -> None:
        """Writes a block of messages (connection, time in ns, data) in the order of their times."""
        storage = self.storage
        assert isinstance(storage, _NumberedMcap)  # noqa: S101 - the only plugin of this class
        storage.write_sorted((connection.id, time, data) for connection, time, data in messages)
        for connection, _, _ in messages:
            self.counts[connection.id] += 1
        self.min_timestamp = min(self.min_timestamp, messages[0][1])
        self.max_timestamp = max(self.max_timestamp, messages[-1][1])

    def flush(self) -> None:
        """Puts what has been written so far on disk; a killed process loses only what came later."""
        storage = self.storage
        assert isinstance(storage, _NumberedMcap)  # noqa: S101 - the only plugin of this class
        if storage.chunk.bio.tell():
            storage.close_chunk()

    def reserve(self) -> None:
        """Takes the room that closing the bag will need, while there is some."""
        with (self.path / _RESERVE_FILE).open("wb") as file:
            os.posix_fallocate(file.fileno(), 0, RESERVE)

    def close(self) -> None:
        """Writes index and metadata.yaml; a reserve makes that possible on a full disk too."""
        (self.path / _RESERVE_FILE).unlink(missing_ok=True)
        super().close()


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
