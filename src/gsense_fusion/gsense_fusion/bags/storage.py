"""Raw messages out of rosbag2 storage, whoever wrote it.

The storage files are read themselves, and `metadata.yaml` only for their names and the compression: `rosbags` matches
the metadata's QoS against the storage's and silently yields nothing from a bag that `ros2 bag reindex` rewrote.
"""

from __future__ import annotations

import shutil
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path, PurePath
from tempfile import TemporaryDirectory
from typing import Any

from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader, storage_mcap
from rosbags.rosbag2.metadata import parse_qos

from gsense_driver.user_input.yaml_text import parse_yaml

from .mcap_messages import Sink, read_messages
from .mcap_salvage import is_closed, salvage

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

_SUFFIXES = (".mcap", ".db3")

# rosbags parses the QoS of every topic of every file from YAML, 10 ms each and half the time of opening a campaign; few
# differ, and nothing here looks at them
storage_mcap.parse_qos = lru_cache(maxsize=64)(parse_qos)  # type: ignore[assignment, attr-defined]


class BagError(Exception):
    """The bag cannot be used; one line that names the path and what to do."""


@dataclass
class RawTopic:
    """All messages of a topic as recorded: CDR payloads with the time of their reception."""

    name: str
    msgtype: str
    definition: str
    """Message definition stored in the bag; empty where there is none."""
    count: int
    received_ns: list[int] = field(default_factory=list)
    payloads: list[bytes] = field(default_factory=list)


class Storage:
    """An open bag: its topics, and the raw messages of those asked for."""

    def __init__(
        self, path: Path, readers: list[Reader], unpack: Callable[[bytes], bytes] | None, notes: list[str]
    ) -> None:
        self.path = path
        self.notes = notes
        """What was odd about the files, a line each."""
        self._readers = readers
        self._unpack = unpack
        self.topics: dict[str, RawTopic] = {}
        for reader in readers:
            for connection in reader.connections:
                self._add_topic(connection)

    def _add_topic(self, connection: Connection) -> None:
        known = self.topics.get(connection.topic)
        if known is None:
            self.topics[connection.topic] = RawTopic(
                connection.topic, connection.msgtype, connection.msgdef.data, connection.msgcount
            )
        else:
            known.count += connection.msgcount

    def read(self, names: list[str]) -> dict[str, RawTopic]:
        """Messages of the topics `names`, in order of writing.

        Raises:
            BagError: the storage is damaged.
        """
        wanted = {name: self.topics[name] for name in names}
        for reader in self._readers:
            connections = [c for c in reader.connections if c.topic in wanted]
            if not connections:
                continue
            try:
                self._read_file(reader, connections, wanted)
            except Exception as error:  # each storage library has its own classes; the user needs the one line
                raise BagError(f"{reader.path}: damaged, cannot be read to its end ({_one_line(error)})") from error
        return wanted

    def _read_file(self, reader: Reader, connections: list[Connection], wanted: dict[str, RawTopic]) -> None:
        sinks = {c.id: _sink(wanted[c.topic], self._unpack) for c in connections}
        if Path(str(reader.path)).suffix == ".mcap":
            read_messages(Path(str(reader.path)), sinks)
            return
        for topic, received, payload in _sqlite_rows(reader):
            if topic in sinks:
                sinks[topic]([received], [payload])


def _sqlite_rows(reader: Reader) -> Iterator[tuple[int, int, bytes]]:
    """Topic, time of reception and data in order of writing.

    `rosbags` yields them in order of reception, in which a clock that was set back is not seen.
    """
    database: Any = reader.storage.dbconn  # type: ignore[attr-defined]
    yield from database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY rowid")


def _sink(topic: RawTopic, unpack: Callable[[bytes], bytes] | None) -> Sink:
    def sink(received: list[int], payloads: list[bytes]) -> None:
        topic.received_ns.extend(received)
        topic.payloads.extend(map(unpack, payloads) if unpack else payloads)

    return sink


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__


@contextmanager
def open_storage(path: Path) -> Iterator[Storage]:
    """Open a bag: its folder, or a bare `.mcap` or `.db3` file.

    Raises:
        BagError: not a bag, empty, not closed by its recorder, damaged.
    """
    notes: list[str] = []
    with ExitStack() as stack:
        files, mode = _files(path)
        folder = Path(stack.enter_context(TemporaryDirectory()))
        if mode == "file":
            files = [_decompressed(file, folder) for file in files]
        elif path.is_dir() and not (files[0].parent / "metadata.yaml").exists():
            notes.append("no metadata.yaml, as a killed recorder leaves it; the storage files are read as they are")
        readers = [stack.enter_context(_open_file(file, folder, notes)) for file in _unless_empty(files, notes)]
        yield Storage(path, readers, zstd.decompress if mode == "message" else None, notes)


def _unless_empty(files: list[Path], notes: list[str]) -> list[Path]:
    """Without the last file where it was only begun.

    Raises:
        BagError: another file is empty, or there is no other.
    """
    for file in files[:-1] if len(files) > 1 else files:
        if file.stat().st_size == 0:
            raise BagError(f"{file}: empty file, its recorder was killed before it wrote anything; record again")
    if files[-1].stat().st_size == 0:
        notes.append(f"{files[-1].name}: empty, its recorder was killed before it wrote to it")
        return files[:-1]
    return files


def _files(path: Path) -> tuple[list[Path], str]:
    """Storage files of a bag and its compression mode ("", "file" or "message")."""
    if not path.exists():
        raise BagError(f"{path}: no such bag")
    if path.is_file():
        if path.suffix not in _SUFFIXES:
            raise BagError(f"{path}: not a bag; give a rosbag2 folder, or an .mcap or .db3 file")
        return [path], _metadata(path.parent)[1] if _listed(path) else ""
    path = _bag_folder(path)
    names, mode = _metadata(path)
    files = [path / name for name in names]
    if not files:
        files = sorted((file for file in path.iterdir() if file.suffix in _SUFFIXES), key=_number)
    if not files:
        raise BagError(f"{path}: metadata.yaml names no file and there is no .mcap or .db3 file; record again")
    missing = [file.name for file in files if not file.exists()]
    if missing:
        raise BagError(f"{path}: {missing[0]}, named in metadata.yaml, is missing; copy the whole folder")
    odd = [file.name for file in files if not file.is_file()]
    if odd:  # reading a pipe would wait for ever
        raise BagError(f"{path}: {odd[0]} is no file; copy the whole folder")
    return files, mode


def _number(file: Path) -> tuple[int, str]:
    """Sort key of `<bag>_<n>.<ext>`: by number, so that 10 comes after 9."""
    tail = file.stem.rpartition("_")[2]
    return (int(tail) if tail.isdecimal() else -1, file.name)


def _bag_folder(path: Path) -> Path:
    """The folder itself, or the only bag in it."""
    if is_bag(path):
        return path
    inner = sorted(folder for folder in path.iterdir() if folder.is_dir() and is_bag(folder))
    if len(inner) > 1:
        names = ", ".join(folder.name for folder in inner[:6])
        raise BagError(
            f"{path}: holds {len(inner)} bags, give them one by one ({names}{' ...' if len(inner) > 6 else ''})"
        )
    if not inner:
        raise BagError(f"{path}: not a bag (no metadata.yaml, no .mcap or .db3 file in it)")
    return inner[0]


def is_bag(path: Path) -> bool:
    """Whether a path looks like one bag: its folder, or a storage file."""
    if not path.is_dir():
        return path.is_file() and path.suffix in _SUFFIXES
    return (path / "metadata.yaml").exists() or any(file.suffix in _SUFFIXES for file in path.iterdir())


def _listed(file: Path) -> bool:
    return file.name in _metadata(file.parent)[0]


def _metadata(folder: Path) -> tuple[list[str], str]:
    """File names and compression mode of `metadata.yaml`; ([], "") where there is none."""
    file = folder / "metadata.yaml"
    if not file.exists():
        return [], ""
    try:
        content: Any = parse_yaml(file.read_text(encoding="utf-8"))
        info = content["rosbag2_bagfile_information"]
        names = [PurePath(name).name for name in info["relative_file_paths"]]
        mode = str(info.get("compression_mode") or "").lower()
        codec = str(info.get("compression_format") or "")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise BagError(
            f"{file}: not a rosbag2 metadata file ({_one_line(error)}); delete it to read without"
        ) from error
    mode = "" if mode == "none" else mode
    if mode and codec != "zstd":
        raise BagError(f"{file}: compression {codec!r} is not known; convert the bag with `ros2 bag convert`")
    return names, mode


def _decompressed(file: Path, folder: Path) -> Path:
    target = folder / file.stem  # <bag>_0.mcap.zstd -> <bag>_0.mcap
    try:
        with zstd.open(file, "rb") as source, target.open("wb") as sink:
            shutil.copyfileobj(source, sink)
    except (OSError, EOFError, zstd.ZstdError) as error:
        raise BagError(f"{file}: zstd compression is damaged ({_one_line(error)})") from error
    return target


@contextmanager
def _open_file(file: Path, folder: Path, notes: list[str]) -> Iterator[Reader]:
    """Opens a storage file; of one that was never closed, what is whole of it, with a note of what is missing."""
    left_out: int | None = None
    original = file
    if file.suffix == ".mcap" and not is_closed(file):
        try:
            file, left_out = salvage(file, folder)
        except (OSError, ValueError) as error:
            raise BagError(
                f"{file}: not closed by its recorder, and nothing can be read ({_one_line(error)})"
            ) from error
    try:
        reader = Reader(file)
        reader.open()
    except Exception as error:  # storage libraries raise their own classes (apsw, struct, KeyError ...)
        raise BagError(f"{original}: cannot be opened as a bag ({_one_line(error)})") from error
    try:
        if left_out is not None:
            notes.append(_salvage_note(original, reader, left_out))
        yield reader
    finally:
        reader.close()


def _salvage_note(file: Path, reader: Reader, left_out: int) -> str:
    percent = 100.0 * left_out / file.stat().st_size
    span = reader.duration * 1e-9
    return (
        f"{file.name}: its recorder was killed; read are {reader.message_count} messages of {span:.1f} s,"
        f" the last {left_out} bytes ({percent:.2g} %) and what had not been written are lost"
    )
