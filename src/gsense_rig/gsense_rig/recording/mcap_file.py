"""One MCAP file of a bag: `rosbags`' writer with a whole-or-nothing file, quick chunks and check sums."""

from __future__ import annotations

import os
import struct
from binascii import crc32
from collections import defaultdict
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Final

import numpy as np
import numpy.typing as npt
from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.storage_mcap import Channel, McapWriter, PendingChunk, write_channel, write_string

CHUNK: Final = 1 << 20
"""Bytes after which a chunk goes to disk."""
MESSAGE: Final = struct.Struct("<BQHIQQ")
"""MCAP record 0x05: opcode, length, channel, sequence, log time, publish time; the data follow."""
_CHUNK_RECORD, _INDEX_RECORD, _MESSAGE_RECORD = 0x06, 0x07, 0x05
_NEVER: Final = 2**63 - 1
Times = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Block:
    """Consecutive message records and where each begins."""

    records: bytes
    channels: Times
    """(n,) connection ids."""
    times: Times
    """(n,) ns; they do not fall."""
    offsets: Times
    """(n,) bytes from the block's begin."""


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


class McapFile(McapWriter):
    """The library names the file <bag>.mcap; here its path is given: `ros2 bag reindex` wants <bag>_<n>.mcap.

    A chunk or an end that cannot be written (the disk is full) raises OSError and leaves the file as it was before.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(path.parent, CompressionMode.NONE)
        self.path = self.path.rename(path)
        descriptor = os.dup(self.bio.fileno())
        self.bio.close()  # flushes what the library has written so far
        self.bio = _WholeFile(descriptor)  # type: ignore[assignment]
        self.announced: list[tuple[Connection, str]] = []
        """Connections and their QoS as it stands in the file."""
        self._blocks: list[tuple[Block, int]] = []
        self._types: set[str] = set()

    def add_connection(self, connection: Connection, offered_qos_profiles: str) -> None:
        """As the library's, and with the type's hash, as rosbag2 keeps it; the type is added where it is new."""
        if connection.msgtype not in self._types:
            self.add_msgtype(connection)
        extension = connection.ext
        assert isinstance(extension, ConnectionExtRosbag2)  # noqa: S101 - of a rosbag2 bag
        metadata = BytesIO()
        for entry in ("offered_qos_profiles", offered_qos_profiles, "topic_type_hash", connection.digest):
            write_string(metadata, entry)
        channel = Channel(
            connection.id, connection.msgtype, connection.topic, extension.serialization_format, metadata.getvalue()
        )
        self.channels.append(channel)
        self.channel_stats[connection.id] = 0
        write_channel(self.chunk.bio, channel, self.schemas)
        self.announced.append((connection, offered_qos_profiles))

    def add_msgtype(self, connection: Connection) -> None:
        """As the library's, once for each type."""
        if connection.msgtype not in self._types:
            self._types.add(connection.msgtype)
            super().add_msgtype(connection)

    @property
    def size(self) -> int:
        """Bytes in the file and in the chunk in hand."""
        return self.bio.tell() + self.chunk.bio.tell()

    @property
    def count(self) -> int:
        """Messages in the file and in the chunk in hand."""
        return sum(self.channel_stats.values())

    def write_block(self, block: Block) -> None:
        """Writes many messages at once; far faster than one by one."""
        if not block.times.shape[0]:
            return
        chunk = self.chunk
        self._blocks.append((block, chunk.bio.tell()))
        chunk.bio.write(block.records)
        first, last = int(block.times[0]), int(block.times[-1])
        chunk.message_start_time = min(first, chunk.message_start_time)
        chunk.message_end_time = max(last, chunk.message_end_time)
        self.message_start_time = min(first, self.message_start_time)
        self.message_end_time = max(last, self.message_end_time)
        for channel, count in zip(*np.unique(block.channels, return_counts=True), strict=True):
            self.channel_stats[int(channel)] += int(count)
        if chunk.bio.tell() > CHUNK:
            self.close_chunk()

    def close_chunk(self) -> None:
        """Puts the chunk in hand on disk with its indices; where that fails it stays in hand."""
        chunk, start = self.chunk, self.bio.tell()
        records = chunk.bio.getvalue()
        head = struct.pack("<QQQII", *_times(chunk), len(records), crc32(records), 0)  # an empty name: not compressed
        content = head + struct.pack("<Q", len(records)) + records
        parts = [struct.pack("<BQ", _CHUNK_RECORD, len(content)) + content]
        offsets: list[tuple[int, int]] = []
        at = behind = start + len(parts[0])
        for channel, entries in self._indices():
            offsets.append((channel, at))
            body = struct.pack("<HI", channel, entries.nbytes) + entries.tobytes()
            parts.append(struct.pack("<BQ", _INDEX_RECORD, len(body)) + body)
            at += len(parts[-1])
        try:
            self.bio.write(b"".join(parts))
        except OSError:
            self.bio.take_back(start)  # type: ignore[attr-defined]
            raise
        self.chunks.append(_chunk_index(chunk, start, behind, at, offsets, len(records)))
        self.chunk = PendingChunk(_NEVER, 0, BytesIO(), defaultdict(list))
        self._blocks = []

    def close(self, version: int, metadata: str) -> None:
        """Writes the rest, the summary and the end; where that fails it may be tried again."""
        if self.chunk.bio.tell():
            self.close_chunk()
        start = self.bio.tell()
        try:
            super().close(version, metadata)
        except OSError:
            self.bio.take_back(start)  # type: ignore[attr-defined]
            raise

    def _indices(self) -> list[tuple[int, npt.NDArray[np.uint64]]]:
        """For each channel of the chunk (n, 2): log time and offset."""
        found: dict[int, list[npt.NDArray[np.uint64]]] = defaultdict(list)
        for channel, entries in self.chunk.msgs.items():
            found[channel].append(np.array(entries, dtype=np.uint64).reshape(-1, 2))
        for block, base in self._blocks:
            both = np.column_stack([block.times, block.offsets + base]).astype(np.uint64)
            for channel in np.unique(block.channels).tolist():
                found[channel].append(both[block.channels == channel])
        return [(channel, np.concatenate(found[channel])) for channel in sorted(found)]


def _times(chunk: PendingChunk) -> tuple[int, int]:
    """First and last time; both 0 in a chunk without messages, as the format wants it."""
    if chunk.message_start_time > chunk.message_end_time:
        return 0, 0
    return chunk.message_start_time, chunk.message_end_time


def _chunk_index(
    chunk: PendingChunk, start: int, behind: int, end: int, offsets: list[tuple[int, int]], size: int
) -> BytesIO:
    """Content of a ChunkIndex record (0x08)."""
    record = BytesIO()
    record.write(struct.pack("<QQQQI", *_times(chunk), start, behind - start, len(offsets) * 10))
    record.write(b"".join(struct.pack("<HQ", channel, offset) for channel, offset in offsets))
    record.write(struct.pack("<Q", end - behind))
    write_string(record, "")
    record.write(struct.pack("<QQ", size, size))
    return record
