"""What is whole of an MCAP file that its recorder never closed.

A killed recorder leaves the file without its index and end, with the last record cut. What stands before is sound: the
records up to there, with an end behind them, are an MCAP file without an index (https://mcap.dev/spec), which every
reader opens.
"""

from __future__ import annotations

import mmap
import struct
from pathlib import Path

from .mcap_messages import read_chunk

MAGIC = b"\x89MCAP0\r\n"
_RECORD = struct.Struct("<BQ")
_END = struct.pack("<BQI", 0x0F, 4, 0) + struct.pack("<BQQQI", 0x02, 20, 0, 0, 0) + MAGIC
"""DataEnd and Footer, both without check sums, and the closing magic."""
_CHUNK = 0x06
_IN_CHUNK = (0x03, 0x04, 0x05)
"""Schema, channel, message."""
_LAST_OPCODE = 0x0E
"""Above it: the end of the data section, and what no version of the format knows."""


def is_closed(file: Path) -> bool:
    """Whether the file has an MCAP's end."""
    with file.open("rb") as source:
        source.seek(max(0, file.stat().st_size - len(MAGIC)))
        return source.read() == MAGIC


def salvage(file: Path, folder: Path) -> tuple[Path, int]:
    """Copy the whole records of a file that was not closed, and end the copy.

    Args:
        file: an MCAP file.
        folder: where the copy goes, under the file's name.

    Returns:
        The copy, and how many bytes at the file's end are left out.

    Raises:
        ValueError: not an MCAP file, or one that ends before its first chunk.
    """
    copy = folder / file.name
    with file.open("rb") as source, mmap.mmap(source.fileno(), 0, access=mmap.ACCESS_READ) as data:
        end = _whole(data)
        with copy.open("wb") as sink:
            sink.write(data[:end])
            sink.write(_END)
        return copy, len(data) - end


def _whole(data: mmap.mmap) -> int:
    """Offset behind the last sound record."""
    if data[: len(MAGIC)] != MAGIC:
        raise ValueError("not an MCAP file")
    at, chunks = len(MAGIC), 0
    while at + _RECORD.size <= len(data):
        opcode, length = _RECORD.unpack_from(data, at)
        following = at + _RECORD.size + length
        if following > len(data) or not 0 < opcode <= _LAST_OPCODE:
            break
        if opcode == _CHUNK:
            try:
                _check(read_chunk(data, at + _RECORD.size, length))
            except (ValueError, struct.error):
                break
            chunks += 1
        at = following
    if not chunks:
        raise ValueError("it ends before its first chunk")
    return at


def _check(records: bytes) -> None:
    """Walk a chunk's records: most recorders leave its check sum out. Raises ValueError where they make no sense."""
    at = 0
    while at + _RECORD.size <= len(records):
        opcode, length = _RECORD.unpack_from(records, at)
        if opcode not in _IN_CHUNK:
            break
        at += _RECORD.size + length
    if at != len(records):
        raise ValueError("a chunk holds what is no record")
