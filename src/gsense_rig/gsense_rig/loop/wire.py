"""Objects over pipes, without ever blocking the sender. Both ends are ours, so pickle is safe here."""

from __future__ import annotations

import contextlib
import fcntl
import os
import pickle
import struct
from collections import deque
from typing import Any

_LENGTH = struct.Struct("<I")
_PIPE_SIZE = 1 << 20  # bytes; about 15 s of telemetry
_F_SETPIPE_SZ = 1031  # Linux; not named in Python 3.10's fcntl on every build
_BACKLOG = 20_000  # frames kept while the pipe is full


class PipeClosed(ConnectionError):  # noqa: N818 - a state, not an error of the caller
    """The other end is gone."""


class FrameWriter:
    """Writes objects to a pipe; what does not fit now waits in a bounded backlog, oldest dropped and counted."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._backlog: deque[bytes] = deque()
        self.dropped = 0
        os.set_blocking(fd, False)
        with contextlib.suppress(OSError):
            fcntl.fcntl(fd, _F_SETPIPE_SZ, _PIPE_SIZE)

    def send(self, item: object) -> None:
        """Queue one object and write what fits.

        Raises:
            PipeClosed: nobody reads any more.
        """
        body = pickle.dumps(item, protocol=pickle.HIGHEST_PROTOCOL)
        if len(self._backlog) >= _BACKLOG:
            del self._backlog[1]  # the first may be half written
            self.dropped += 1
        self._backlog.append(_LENGTH.pack(len(body)) + body)
        self.flush()

    def flush(self) -> bool:
        """Write what fits; true when nothing waits any more.

        Raises:
            PipeClosed: nobody reads any more.
        """
        while self._backlog:
            data = self._backlog[0]
            try:
                written = os.write(self._fd, data)
            except BlockingIOError:
                return False
            except OSError as error:
                raise PipeClosed(str(error)) from error
            if written < len(data):
                self._backlog[0] = data[written:]
            else:
                self._backlog.popleft()
        return True


class FrameReader:
    """Reads objects from a pipe."""

    def __init__(self, fd: int, blocking: bool) -> None:
        self._fd = fd
        self._data = bytearray()
        os.set_blocking(fd, blocking)

    def receive(self) -> list[Any]:
        """Read the objects that have arrived (a blocking reader waits for some bytes; the list may be empty).

        Raises:
            PipeClosed: the other end is gone.
        """
        try:
            data = os.read(self._fd, 1 << 16)
        except BlockingIOError:
            return []
        except OSError as error:
            raise PipeClosed(str(error)) from error
        if not data:
            raise PipeClosed("end of file")
        self._data += data
        return self._take()

    def _take(self) -> list[Any]:
        items: list[Any] = []
        start = 0
        while len(self._data) - start >= _LENGTH.size:
            (size,) = _LENGTH.unpack_from(self._data, start)
            end = start + _LENGTH.size + size
            if len(self._data) < end:
                break
            items.append(pickle.loads(self._data[start + _LENGTH.size : end]))  # noqa: S301 - our own process
            start = end
        del self._data[:start]
        return items
