"""The messages of an MCAP file, fast.

`rosbags` opens the file and reads its index; its message iterator, however, is many times slower than this: here each
chunk is decompressed and walked once, by compiled code.

Format: https://mcap.dev/spec. A record is u8 opcode, u64 length, content; a Chunk (6) holds u64 start, u64 end, u64
uncompressed size, u32 CRC-32 (0: none), string compression, u64 size, records; a Message (5) holds u16 channel, u32
sequence, u64 log time, u64 publish time, data.
"""

from __future__ import annotations

import mmap
import struct
import sys
from binascii import crc32
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from lz4.frame import decompress as _lz4  # type: ignore[import-untyped,unused-ignore]

from gsense_fusion.compiling import kernel

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

Sink = Callable[[list[int], list[bytes]], None]
"""Takes the log times (ns) and the data of some messages of a topic."""

_MAGIC_LENGTH = 8
_DECOMPRESS: dict[str, Callable[[bytes], bytes]] = {"": bytes, "zstd": zstd.decompress, "lz4": _lz4}
_RECORD = struct.Struct("<BQ")
_CHUNK = struct.Struct("<QQQII")
_MESSAGE_HEADER = 9 + 22


def read_messages(path: Path, sinks: Mapping[int, Sink]) -> None:
    """Hand every message to the sink of its channel, in order of the file, chunk by chunk.

    Args:
        path: an MCAP file that was closed properly.
        sinks: channel id -> sink; other channels are skipped.

    Raises:
        ValueError: damaged content, or a compression that is not known.
    """
    with path.open("rb") as source, mmap.mmap(source.fileno(), 0, access=mmap.ACCESS_READ) as data:
        at = _MAGIC_LENGTH
        while at + _RECORD.size <= len(data) - _MAGIC_LENGTH:
            opcode, length = _RECORD.unpack_from(data, at)
            start = at + _RECORD.size
            if start + length > len(data):
                raise ValueError(f"record at byte {at} runs over the end of the file")
            if opcode == 0x06:
                _walk(read_chunk(data, start, length), sinks)
            elif opcode == 0x05:
                _walk(data[at : start + length], sinks)
            elif opcode in (0x0F, 0x02):  # end of the data section, footer
                return
            at = start + length


def read_chunk(data: mmap.mmap, start: int, length: int) -> bytes:
    """Records of a chunk, decompressed and checked.

    Args:
        data: the whole file.
        start: offset of the chunk's content.
        length: bytes of the content.

    Raises:
        ValueError: the chunk is damaged, or its compression is not known.
    """
    _, _, size, checksum, name_length = _CHUNK.unpack_from(data, start)
    at = start + _CHUNK.size
    name = data[at : at + name_length].decode()
    if name not in _DECOMPRESS:
        raise ValueError(f"compression {name!r} of the chunk at byte {start} is not known")
    at += name_length + 8
    try:
        records = _DECOMPRESS[name](data[at : start + length])
    except (zstd.ZstdError, RuntimeError) as error:
        raise ValueError(f"chunk at byte {start} cannot be decompressed") from error
    if len(records) != size or (checksum and crc32(records) != checksum):
        raise ValueError(f"chunk at byte {start} fails its check")
    return records


def _walk(records: bytes, sinks: Mapping[int, Sink]) -> None:
    channels, times, starts, ends = _messages(np.frombuffer(records, np.uint8))
    if len(ends) and ends[-1] < 0:
        raise ValueError("a record runs over the end of its chunk")
    for channel in np.unique(channels).tolist():
        sink = sinks.get(channel)
        if sink is not None:
            mine = np.flatnonzero(channels == channel)
            bounds = zip(starts[mine].tolist(), ends[mine].tolist(), strict=True)
            sink(times[mine].tolist(), [records[start:end] for start, end in bounds])


@kernel("i8(Array(u1, 1, 'C', readonly=True), i8, i8)")
def _number(data, at, size):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    value = 0
    for i in range(size):
        value |= np.int64(data[at + i]) << (8 * i)
    return value


@kernel("Tuple((i8[::1], i8[::1], i8[::1], i8[::1]))(Array(u1, 1, 'C', readonly=True))")
def _messages(data):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Channel, log time (ns), start and end of the data of every message; a last end of -1: a record runs over."""
    size = data.shape[0]
    room = size // _MESSAGE_HEADER + 1
    channel, time = np.empty(room, np.int64), np.empty(room, np.int64)
    start, end = np.empty(room, np.int64), np.empty(room, np.int64)
    at = n = 0
    while at < size:
        length = _number(data, at + 1, 8) if at + 9 <= size else -1
        message = data[at] == 0x05
        if length < 0 or length > size - at - 9 or (message and length < _MESSAGE_HEADER - 9):
            end[n] = -1
            n += 1
            break
        if message:
            channel[n], time[n] = _number(data, at + 9, 2), _number(data, at + 15, 8)
            start[n], end[n] = at + _MESSAGE_HEADER, at + 9 + length
            n += 1
        at += 9 + length
    return channel[:n], time[:n], start[:n], end[:n]
