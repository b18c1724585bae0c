"""The raw log: every byte of the serial line with its arrival time, and all else that the messages depend on.

A file is a header and records, little-endian, each record complete in itself: a file that was cut off anywhere is
read up to its last whole record.

header   8 bytes "GSNSRAW1"; u32 length; JSON of that length (`RawLogHeader`)
record   u8 kind; 3 bytes zero; u32 length; i64 time (steady clock of the host, ns); payload of that length

kind 1   DATA      bytes of one read; its time is their arrival
kind 2   OPENED    the port was lost or opened: an unfinished packet is void
kind 3   WALL      i64: wall clock minus steady clock from here on, ns
kind 4   SETTINGS  JSON: all parameters from here on
kind 5   REPORT    i64: wall clock, ns; UTF-8: what is wrong with the port, empty: nothing. `link` and `/diagnostics`
                   were published here
kind 6   LOST      u64, u64: records and their bytes that the disk was too slow for
kind 7   END       the log was closed in order
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from enum import IntEnum
from struct import Struct
from struct import error as StructError  # noqa: N812 - else it would be called `error`
from typing import Any, BinaryIO, NamedTuple

from gsense_driver.errors import RawLogError

MAGIC = b"GSNSRAW1"
SCHEMA = "gsense-raw-log/1"
_LENGTH = Struct("<I")
_RECORD = Struct("<B3xIq")
_HEADER_LIMIT = 1 << 20
_PAYLOAD_LIMIT = 1 << 26
WALL_PAYLOAD = Struct("<q")
LOST_PAYLOAD = Struct("<QQ")


class Kind(IntEnum):
    """What a record is."""

    DATA = 1
    OPENED = 2
    WALL = 3
    SETTINGS = 4
    REPORT = 5
    LOST = 6
    END = 7


class Record(NamedTuple):
    """One record; `time_ns` is of the host's steady clock."""

    kind: Kind
    time_ns: int
    payload: bytes


@dataclass(frozen=True)
class RawLogHeader:
    """What a log starts with."""

    port: str
    baud: int
    protocol: str
    unit_id: str
    wall_offset_ns: int  # wall clock minus steady clock at the start
    parameters: Mapping[str, Any]  # of the bridge, by name
    schema: str = SCHEMA


def encode_header(header: RawLogHeader) -> bytes:
    """Magic, length and JSON."""
    text = json.dumps(asdict(header), sort_keys=True).encode()
    return MAGIC + _LENGTH.pack(len(text)) + text


def encode_record(kind: Kind, time_ns: int, payload: bytes = b"") -> bytes:
    """One record."""
    return _RECORD.pack(kind, len(payload), time_ns) + payload


def read_header(stream: BinaryIO, name: str) -> RawLogHeader:
    """Read the header; raises RawLogError with one line that names the file where it is none."""
    start = stream.read(len(MAGIC) + _LENGTH.size)
    if not start.startswith(MAGIC) or len(start) < len(MAGIC) + _LENGTH.size:
        raise RawLogError(f"{name}: is no raw log of the bridge (it does not start with {MAGIC.decode()})")
    (size,) = _LENGTH.unpack_from(start, len(MAGIC))
    try:
        values = json.loads(stream.read(size) if size <= _HEADER_LIMIT else b"")
        header = RawLogHeader(**values)
    except (ValueError, TypeError) as error:
        raise RawLogError(f"{name}: its header is damaged ({' '.join(str(error).split())})") from error
    if header.schema != SCHEMA:
        raise RawLogError(f"{name}: is of schema {header.schema}; this version reads {SCHEMA}")
    return header


def read_records(stream: BinaryIO, name: str) -> Iterator[Record]:
    """Records up to END or the last whole one; raises RawLogError where something else stands in a record's place."""
    while True:
        place = stream.tell()
        head = stream.read(_RECORD.size)
        if len(head) < _RECORD.size:
            return
        number, size, time_ns = _RECORD.unpack(head)
        if number not in list(Kind) or size > _PAYLOAD_LIMIT:
            raise RawLogError(f"{name}: damaged at byte {place}; what stands before it was read")
        payload = stream.read(size)
        if len(payload) < size:
            return
        yield Record(Kind(number), time_ns, payload)
        if number == Kind.END:
            return


def encode_report(wall_ns: int, problem: str | None) -> bytes:
    """Payload of REPORT."""
    return WALL_PAYLOAD.pack(wall_ns) + (problem or "").encode()


def decode_report(payload: bytes) -> tuple[int, str | None]:
    """Wall clock in ns and what is wrong with the port; raises RawLogError."""
    (wall_ns,) = _unpack(WALL_PAYLOAD, payload[: WALL_PAYLOAD.size], "REPORT")
    return wall_ns, payload[WALL_PAYLOAD.size :].decode(errors="replace") or None


def decode_wall(payload: bytes) -> int:
    """Wall clock minus steady clock, ns; raises RawLogError."""
    (offset_ns,) = _unpack(WALL_PAYLOAD, payload, "WALL")
    return offset_ns


def decode_lost(payload: bytes) -> tuple[int, int]:
    """Records and bytes that were lost; raises RawLogError."""
    records, size = _unpack(LOST_PAYLOAD, payload, "LOST")
    return records, size


def decode_settings(payload: bytes) -> dict[str, Any]:
    """Parameters by name; raises RawLogError."""
    try:
        values = json.loads(payload)
    except ValueError as error:
        raise RawLogError(f"a SETTINGS record is damaged ({error})") from error
    if not isinstance(values, dict):
        raise RawLogError("a SETTINGS record is damaged (no JSON object)")
    return values


def _unpack(layout: Struct, payload: bytes, what: str) -> tuple[int, ...]:
    try:
        return layout.unpack(payload)
    except StructError as error:
        raise RawLogError(f"a {what} record is damaged ({error})") from error
