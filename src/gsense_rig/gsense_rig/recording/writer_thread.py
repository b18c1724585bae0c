"""Writes a bag in a thread of its own, so that a slow disk never holds up a subscription."""

from __future__ import annotations

import queue
import threading
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rosbags.interfaces import Connection, Qos
from rosbags.typesys.store import Typestore

from gsense_rig.recording.bag import BagWriter

FLUSH_PERIOD = 0.5
"""s after which what has come goes to disk: a killed recorder loses less than a second."""
MAX_QUEUE = 256 << 20
"""Bytes that wait for the disk at most: minutes of the whole graph."""


@dataclass(frozen=True)
class Topic:
    """A topic to be recorded, as the graph shows it."""

    name: str
    msgtype: str
    qos: tuple[Qos, ...]
    """Offered by each publisher."""


@dataclass(frozen=True)
class Summary:
    """What a recording holds."""

    bag: Path
    counts: dict[str, int]
    """Messages by topic; topics without any are there with 0."""
    unwritten: int
    """Messages that came after the disk was full; all where the bag is gone."""
    overflow: dict[str, int]
    """Messages by topic that found no room in memory, because the disk was too slow."""
    error: str | None
    """Why the recording ended early; one line."""


class BagThread:
    """Takes messages from any thread; `finish` writes what is left and closes the bag."""

    def __init__(self, bag: Path, store: Typestore, max_bytes: int = 0, max_queue: int = MAX_QUEUE) -> None:
        """Creates the bag.

        Args:
            bag: its folder.
            store: knows the types of the topics.
            max_bytes: size of a storage file after which the next one is begun; 0: never.
            max_queue: bytes that may wait for the disk.

        Raises:
            rosbags.rosbag2.WriterError: the folder exists.
            OSError: it cannot be made.
        """
        self._writer = BagWriter(bag, max_bytes)
        self._writer.open()
        self._writer.reserve()
        self._store = store
        self._queue: queue.SimpleQueue[tuple[Topic | str, int, bytes] | None] = queue.SimpleQueue()
        self._connections: dict[str, Connection] = {}
        self._received: Counter[str] = Counter()
        self._overflow: Counter[str] = Counter()
        self._max_queue = max_queue
        self._put = self._taken = 0  # bytes; each is written by one thread alone
        self._error: str | None = None
        self._thread = threading.Thread(target=self._run, name="bag writer")
        self._thread.start()

    @property
    def error(self) -> str | None:
        """Why writing has failed; None while it has not."""
        return self._error

    def add_topic(self, topic: Topic) -> None:
        """Announces a topic; before its first message."""
        self._queue.put((topic, 0, b""))

    def put(self, topic: str, time_ns: int, data: bytes) -> None:
        """One serialised message, at the time of its arrival; from one thread. Drops and counts it where none fits."""
        if self._put - self._taken + len(data) > self._max_queue:
            self._overflow[topic] += 1
            return
        self._put += len(data)
        self._queue.put((topic, time_ns, data))

    @property
    def overflow(self) -> int:
        """Messages dropped so far."""
        return sum(self._overflow.values())

    def finish(self) -> Summary:
        """Closes the bag; safe to call once."""
        self._queue.put(None)
        self._thread.join()
        unwritten = sum(self._received.values()) - self._writer.total
        for name, count in (("unwritten", unwritten), ("overflow", self.overflow)):
            if count:
                self._writer.set_custom_data(f"gsense.{name}", str(count))
        try:
            self._writer.close()
        except OSError as error:
            self._error = self._error or _line(self._writer.path, error)
        counts = {name: self._writer.counts[c.id] for name, c in self._connections.items()}
        if not self._writer.path.exists():
            counts, unwritten = dict.fromkeys(counts, 0), sum(self._received.values())
        return Summary(self._writer.path, counts, unwritten, dict(self._overflow), self._error)

    def _run(self) -> None:
        flushed = time.monotonic()
        while True:
            try:
                item = self._queue.get(timeout=FLUSH_PERIOD)
            except queue.Empty:
                item = ("", 0, b"")
            if item is None:
                return
            self._take(*item)
            self._taken += len(item[2])
            if time.monotonic() - flushed >= FLUSH_PERIOD:
                flushed = time.monotonic()
                self._guarded(self._writer.flush)

    def _take(self, topic: Topic | str, time_ns: int, data: bytes) -> None:
        if isinstance(topic, Topic):
            self._connect(topic)
        elif topic:
            self._received[topic] += 1
            if self._error is None:
                self._guarded(self._writer.write, self._connections[topic], time_ns, data)

    def _connect(self, topic: Topic) -> None:
        self._connections[topic.name] = self._writer.add_connection(
            topic.name, topic.msgtype, typestore=self._store, offered_qos_profiles=topic.qos
        )

    def _guarded(self, action: Callable[..., None], *arguments: object) -> None:
        if self._error is not None:
            return
        try:
            action(*arguments)
        except OSError as error:
            self._error = _line(self._writer.path, error)


def _line(path: Path, error: OSError) -> str:
    return f"{path}: writing failed: {error.strerror or error}"
