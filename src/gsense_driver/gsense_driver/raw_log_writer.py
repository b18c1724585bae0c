"""Writes a raw log from a thread of its own: whoever reads the serial port never waits for a disk.

What has been put is in the file within a quarter of a second, also when the process is killed after that. Where the
disk is too slow, or full, records are dropped and counted, and the log says where (LOST).
"""

from __future__ import annotations

import itertools
import os
import threading
import time
from pathlib import Path
from typing import BinaryIO

from gsense_driver.errors import SettingError
from gsense_driver.raw_log import LOST_PAYLOAD, Kind, RawLogHeader, encode_header, encode_record

_PERIOD_S = 0.2
LIMIT_BYTES = 16 << 20  # waiting for the disk; an hour of 600 frames/s is 110 MB


class RawLogWriter:
    """A raw log being written. Make it, `put` records from any thread, `close` it."""

    def __init__(self, path: str, header: RawLogHeader, limit_bytes: int = LIMIT_BYTES) -> None:
        """Create the file; raises SettingError where that is not possible. An existing file is never written to."""
        self.path, self._file = _create(Path(path).expanduser())
        self.written = 0  # bytes
        self.lost_records = 0
        self.lost_bytes = 0
        self.problem: str | None = None
        self._limit = limit_bytes
        self._lock = threading.Lock()
        self._queue: list[bytes] = [encode_header(header)]
        self._queued = 0
        self._untold = [0, 0]  # lost records and bytes that the log does not tell of yet
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="raw_log", daemon=True)
        self._thread.start()

    def put(self, kind: Kind, time_ns: int, payload: bytes = b"") -> None:
        """Queue a record; never waits for the disk."""
        with self._lock:
            if self.problem is not None or self._queued + len(payload) > self._limit:
                self._lose(len(payload))
                return
            if self._untold[0]:
                self._append(encode_record(Kind.LOST, time_ns, LOST_PAYLOAD.pack(*self._untold)))
                self._untold = [0, 0]
            self._append(encode_record(kind, time_ns, payload))

    def close(self) -> None:
        """Write what is queued and END, bring it to the disk, close. A second call does nothing."""
        if self._stop.is_set():
            return
        self.put(Kind.END, time.monotonic_ns())
        self._stop.set()
        self._thread.join(timeout=5.0)

    def _append(self, record: bytes) -> None:
        self._queue.append(record)
        self._queued += len(record)

    def _lose(self, size: int) -> None:
        self.lost_records += 1
        self.lost_bytes += size
        self._untold[0] += 1
        self._untold[1] += size

    def _run(self) -> None:
        stopping = False
        while not stopping:
            stopping = self._stop.wait(_PERIOD_S)
            self._drain()
        try:
            os.fsync(self._file.fileno())
            self._file.close()
        except OSError as error:
            self._fail(error)

    def _drain(self) -> None:
        with self._lock:
            data = b"".join(self._queue)
            self._queue.clear()
        try:
            view = memoryview(data)
            while view and self.problem is None:
                done = self._file.write(view)
                self.written += done
                view = view[done:]
        except OSError as error:
            self._fail(error)
        with self._lock:
            self._queued = sum(map(len, self._queue))

    def _fail(self, error: OSError) -> None:
        if self.problem is None:  # the first says why
            self.problem = f"{self.path}: {error.strerror or error}"


def _create(path: Path) -> tuple[Path, BinaryIO]:
    """Create `path`, or where it exists the first free of NAME-2, NAME-3, ..."""
    for number in itertools.count(1):
        name = path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")
        try:
            return name, name.open("xb", buffering=0)
        except FileExistsError:
            continue
        except OSError as error:
            raise SettingError(f"raw_log: cannot create {name} ({error.strerror or error})") from error
    raise AssertionError
