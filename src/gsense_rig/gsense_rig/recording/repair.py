"""`record --repair BAG`: gives a bag whose recorder was killed its indices and its metadata.yaml.

Each storage file that was never closed is written anew from its whole chunks, under a temporary name, and takes the
place of the old one; a repair that is itself killed is simply begun again.
"""

from __future__ import annotations

import mmap
import shutil
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from rosbags.interfaces import Connection, ConnectionExtRosbag2
from rosbags.rosbag2 import Reader, WriterError
from rosbags.rosbag2.metadata import dump_qos_v9
from rosbags.rosbag2.storage_mcap import decompress
from rosbags.typesys import get_types_from_msg
from rosbags.typesys.store import Typestore

from gsense_rig.recording.bag import RESERVE_FILE
from gsense_rig.recording.mcap_file import MESSAGE, McapFile
from gsense_rig.recording.metadata import VERSION, BagInformation, FilePart

_MAGIC = b"\x89MCAP0\r\n"
_RECORD = struct.Struct("<BQ")
_CHUNK, _MESSAGE, _LAST_OPCODE = 0x06, 0x05, 0x0E
_END = struct.pack("<BQI", 0x0F, 4, 0) + struct.pack("<BQQQI", 0x02, 20, 0, 0, 0) + _MAGIC
"""DataEnd and Footer, both without check sums, and the closing magic."""
_WORK = ".repair"


class RepairError(RuntimeError):
    """The bag cannot be repaired; the message is one line."""


@dataclass(frozen=True)
class RepairedFile:
    """What became of one storage file."""

    name: str
    kept: int
    """Messages in it."""
    left_out: int | None
    """Bytes of a half-written end; None where the file had been closed."""


def repair(bag: Path, store: Typestore) -> list[RepairedFile]:
    """Repairs a bag's folder in place.

    Args:
        bag: folder with `.mcap` files, ours or those of `ros2 bag record`.
        store: types, for their hashes; types that are new are taken from the files.

    Raises:
        RepairError: no bag, or nothing in it can be read.
    """
    files = sorted(bag.glob("*.mcap"), key=_number) if bag.is_dir() else []
    if not files:
        raise RepairError(f"{bag}: no folder with .mcap files")
    work = bag / _WORK
    shutil.rmtree(work, ignore_errors=True)
    try:
        done = [_repair_file(file, work, store, last=file is files[-1] and len(files) > 1) for file in files]
        _write_metadata(bag, [file for file in files if file.exists()], store)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    (bag / RESERVE_FILE).unlink(missing_ok=True)
    return done


def _repair_file(file: Path, work: Path, store: Typestore, *, last: bool) -> RepairedFile:
    with file.open("rb") as stream:
        stream.seek(max(0, file.stat().st_size - len(_MAGIC)))
        closed = stream.read() == _MAGIC and file.stat().st_size > len(_MAGIC)
    if closed:
        with Reader(file) as reader:
            return RepairedFile(file.name, reader.message_count, None)
    work.mkdir(exist_ok=True)
    try:
        copy, left_out = _closed_copy(file, work)
    except (ValueError, struct.error) as error:
        if not last:
            raise RepairError(f"{file}: nothing in it can be read ({error})") from error
        size = file.stat().st_size
        file.unlink()  # it had only been begun when the recorder was killed
        return RepairedFile(file.name, 0, size)
    target = work / f"new_{file.name}"
    kept = _rewrite(copy, target, store)
    target.replace(file)
    return RepairedFile(file.name, kept, left_out)


def _closed_copy(file: Path, work: Path) -> tuple[Path, int]:
    """The whole records of a file with an end behind them, and the number of bytes that are not among them."""
    copy = work / file.name
    with file.open("rb") as source, copy.open("wb") as sink:
        if file.stat().st_size == 0:
            raise ValueError("it is empty")
        with mmap.mmap(source.fileno(), 0, access=mmap.ACCESS_READ) as data:
            if data[: len(_MAGIC)] != _MAGIC:
                raise ValueError("it is no MCAP file")
            end, chunks = len(_MAGIC), 0
            for opcode, start, following in _records(data, end):
                try:
                    chunks += opcode == _CHUNK and _chunk(data[start:following]) is not None
                except Exception:  # noqa: BLE001 - whatever a decompressor raises: this chunk is not whole
                    break
                end = following
            if not chunks:
                raise ValueError("it ends before its first chunk")
            sink.write(data[:end])
            sink.write(_END)
            return copy, len(data) - end


def _records(data: Any, at: int) -> Iterator[tuple[int, int, int]]:
    """Opcode, begin of the content and end of each whole record."""
    while at + _RECORD.size <= len(data):
        opcode, length = _RECORD.unpack_from(data, at)
        following = at + _RECORD.size + length
        if following > len(data) or not 0 < opcode <= _LAST_OPCODE:
            return
        yield opcode, at + _RECORD.size, following
        at = following


def _chunk(content: bytes) -> bytes:
    """Records of a chunk; raises where they are damaged."""
    size, check, name_length = struct.unpack_from("<QII", content, 16)
    name = content[32 : 32 + name_length].decode()
    records = decompress(content[40 + name_length :], name, size, check)
    if (list(_records(records, 0)) or [(0, 0, 0)])[-1][2] != size:
        raise ValueError("a chunk holds what is no record")
    return records


def _rewrite(source: Path, target: Path, store: Typestore) -> int:
    """Writes a file with indices from one without; returns the number of messages."""
    file = McapFile(target)
    with Reader(source) as reader:
        connections = {found.id: found._replace(digest=_digest(found, store)) for found in reader.connections}
        for connection in connections.values():
            file.add_connection(connection, _qos_text(connection))
    with source.open("rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        for opcode, start, following in _records(data, len(_MAGIC)):
            if opcode != _CHUNK:
                continue
            records = _chunk(data[start:following])
            for kind, begin, end in _records(records, 0):
                if kind == _MESSAGE:
                    _, _, channel, _, time, _ = MESSAGE.unpack_from(records, begin - _RECORD.size)
                    file.write(connections[channel], time, records[begin - _RECORD.size + MESSAGE.size : end])
    part = FilePart(target.name, file.message_start_time, file.message_end_time, file.count)
    file.close(VERSION, BagInformation([part], list(connections.values()), file.channel_stats, {}).text())
    return file.count


def _write_metadata(bag: Path, files: list[Path], store: Typestore) -> None:
    parts: list[FilePart] = []
    counts: dict[int, int] = {}
    connections: dict[tuple[str, str], Connection] = {}
    for file in files:
        with Reader(file) as reader:
            empty = not reader.message_count
            start, end = reader.start_time, reader.end_time - 1
            parts.append(FilePart(file.name) if empty else FilePart(file.name, start, end, reader.message_count))
            for found in reader.connections:
                key = (found.topic, found.msgtype)
                if key not in connections:
                    number = len(connections) + 1
                    connections[key] = found._replace(id=number, digest=_digest(found, store))
                counts[connections[key].id] = counts.get(connections[key].id, 0) + found.msgcount
    BagInformation(parts, list(connections.values()), counts, {}).write(bag)


def _digest(connection: Connection, store: Typestore) -> str:
    """The type's hash; by the definition in the file where the type is not known here."""
    if connection.msgtype not in store.fielddefs:
        known = set(store.fielddefs)
        types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
        store.register({name: kind for name, kind in types.items() if name not in known})
    return store.hash_rihs01(connection.msgtype)


def _qos_text(connection: Connection) -> str:
    extension = connection.ext
    if not isinstance(extension, ConnectionExtRosbag2):
        raise WriterError(f"{connection.topic} is not of a rosbag2 bag")
    return yaml.safe_dump(dump_qos_v9(extension.offered_qos_profiles), sort_keys=False).strip()


def _number(file: Path) -> tuple[int, str]:
    """Sort key of `<bag>_<n>.mcap`."""
    tail = file.stem.rpartition("_")[2]
    return (int(tail) if tail.isdecimal() else -1, file.name)
