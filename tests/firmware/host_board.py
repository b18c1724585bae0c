"""Starts the built host board and reads its pseudo-terminal as the driver would, with a decoder of its own."""

from __future__ import annotations

import binascii
import contextlib
import itertools
import re
import struct
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import serial

MPU, BNO, STATUS, NDOF = 1, 2, 3, 4
FAILED, STARTED, LOW = 1, 2, 4
ENDING = re.compile(r"frames, (\d+) dropped for want of a reader, (\d+) slots skipped")


def uncobs(packet: bytes) -> bytes:
    out, at = bytearray(), 0
    while at < len(packet):
        code = packet[at]
        out += packet[at + 1 : at + code]
        at += code
        if code < 255 and at < len(packet):
            out.append(0)
    return bytes(out)


@dataclass(frozen=True)
class Frame:
    raw: bytes

    @property
    def sound(self) -> bool:
        if len(self.raw) != 32 or self.raw[0] >> 5 != 1:
            return False
        return binascii.crc_hqx(self.raw[:30], 0xFFFF) == struct.unpack("<H", self.raw[30:])[0]

    @property
    def type(self) -> int:
        return self.raw[0] & 31

    @property
    def flags(self) -> int:
        return self.raw[1]

    @property
    def sequence(self) -> int:
        return self.get("<H", 2)

    @property
    def time_us(self) -> int:
        return self.get("<I", 4)

    def get(self, layout: str, offset: int) -> Any:
        return struct.unpack_from(layout, self.raw, offset)[0]


class HostBoard(contextlib.AbstractContextManager["HostBoard"]):
    """The process, the text on its stderr so far, and its link."""

    def __init__(self, binary: Path, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [str(binary), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        self.port = self.process.stdout.readline().strip()
        self.said: list[str] = []
        self._listener = threading.Thread(target=self._listen, daemon=True)
        self._listener.start()

    def __exit__(self, *_: object) -> None:
        self.end()

    def _listen(self) -> None:
        assert self.process.stderr is not None
        self.said.extend(iter(self.process.stderr.readline, ""))

    def end(self) -> int:
        """SIGTERM; returns the exit code."""
        if self.process.poll() is None:
            self.process.terminate()
        code = self.process.wait(timeout=60)
        self._listener.join(timeout=60)
        return code

    def read(self, seconds: float) -> list[Frame]:
        """Frames of so many seconds of wall time."""
        end = time.monotonic() + seconds
        return self.read_until(lambda _: time.monotonic() >= end)

    def read_until(self, enough: Callable[[list[Frame]], bool], limit: float = 60.0) -> list[Frame]:
        """Frames from now on until they are enough; the first, perhaps torn by our coming late, only if it is whole."""
        frames: list[Frame] = []
        first, pending = True, b""
        end = time.monotonic() + limit
        with serial.Serial(self.port, 460800, timeout=0.05) as line:
            while not enough(frames):
                assert time.monotonic() < end, f"only {len(frames)} frames within {limit:g} s"
                *packets, pending = (pending + line.read(max(line.in_waiting, 1))).split(b"\0")
                for frame in map(Frame, map(uncobs, packets)):
                    if frame.sound or not first:
                        frames.append(frame)
                    first = False
        return frames

    @property
    def missed(self) -> int:
        """Packets that the board dropped since we came late to read them, and slots that it skipped since the machine
        stood still; told at its end, and 0 where it gets its time."""
        [told] = (match for line in self.said if (match := ENDING.search(line)))
        return int(told[1]) + int(told[2])


def lost(frames: list[Frame]) -> int:
    """Gaps in the sequence."""
    return sum((b.sequence - a.sequence - 1) % 65536 for a, b in itertools.pairwise(frames))


def uneven(frames: list[Frame], step_us: int) -> int:
    """Steps of the board's time that differ from the one expected; each must be a multiple of it."""
    steps = [(b.time_us - a.time_us) % 2**32 for a, b in itertools.pairwise(frames)]
    assert all(step > 0 and step % step_us == 0 for step in steps)
    return sum(step != step_us for step in steps)


def of_type(frames: list[Frame], kind: int) -> list[Frame]:
    return [frame for frame in frames if frame.type == kind]
