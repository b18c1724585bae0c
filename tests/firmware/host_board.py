"""Starts the built host board and reads its pseudo-terminal as the driver would, with a decoder of its own."""

from __future__ import annotations

import binascii
import contextlib
import itertools
import struct
import subprocess
import threading
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import serial

MPU, BNO, STATUS, NDOF = 1, 2, 3, 4
FAILED, STARTED, LOW = 1, 2, 4


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
        code = self.process.wait(timeout=10)
        self._listener.join(timeout=5)
        return code

    def read(self, seconds: float) -> list[Frame]:
        """Frames of so many seconds of wall time; the first, perhaps torn by our coming late, only if it is whole."""
        data = bytearray()
        end = time.monotonic() + seconds
        with serial.Serial(self.port, 460800, timeout=0.05) as line:
            while time.monotonic() < end:
                data += line.read(max(line.in_waiting, 1))
        packets = bytes(data).split(b"\0")[:-1]
        frames = [Frame(uncobs(packet)) for packet in packets]
        return frames if not frames or frames[0].sound else frames[1:]


def lost(frames: list[Frame]) -> int:
    """Gaps in the sequence."""
    return sum((b.sequence - a.sequence - 1) % 65536 for a, b in itertools.pairwise(frames))


def of_type(frames: list[Frame], kind: int) -> list[Frame]:
    return [frame for frame in frames if frame.type == kind]
