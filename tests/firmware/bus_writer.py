"""A sensor bus written for the host board's tests: images that say at which millisecond they were made."""

from __future__ import annotations

import mmap
import struct
import threading
import time
from pathlib import Path

CAPACITY, IMAGE_SIZE, IMAGES_AT = 256, 128, 512
MS = 1_000_000
BNO_PERIOD_NS = 10_030_000


class BusWriter:
    """Writes an image for every millisecond of CLOCK_MONOTONIC, in bursts where `hold` stops it for a while.

    Accelerometer x of the MPU is the millisecond's number, gyro x of the BNO055 its sample's (both modulo 2^15).
    """

    def __init__(self, path: Path, lisy: int = 300, battery_mv: int = 3700) -> None:
        self.lisy, self.battery_mv = lisy, battery_mv
        temporary = path.with_name(path.name + ".new")
        with temporary.open("w+b") as file:
            file.truncate(IMAGES_AT + CAPACITY * IMAGE_SIZE)
            self.map = mmap.mmap(file.fileno(), 0)
        self.map[:16] = b"GSNSBUS1" + struct.pack("<II", CAPACITY, IMAGE_SIZE)
        self.count = 0
        self.next_ms = time.monotonic_ns() // MS
        self._end = threading.Event()
        self._free = threading.Event()
        self._free.set()
        self.advance()
        temporary.replace(path)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def advance(self) -> None:
        now = time.monotonic_ns()
        while self.next_ms * MS <= now:
            at = IMAGES_AT + self.count % CAPACITY * IMAGE_SIZE
            self.map[at : at + IMAGE_SIZE] = self.image(self.next_ms)
            self.count += 1
            self.next_ms += 1
        self.map[16:32] = struct.pack("<QQ", self.count, now)

    def image(self, ms: int) -> bytes:
        sample = ms * MS // BNO_PERIOD_NS
        mpu = struct.pack(">7h", ms % 2**15, 0, 8192, -3920, 1, 2, 3)
        bno = struct.pack("<9h", 0, 0, 981, 1, 2, 3, sample % 2**15, 0, 0) + bytes(26) + struct.pack("<bB", 25, 0)
        lisy = struct.pack("<16H", *[self.lisy] * 16)
        body = struct.pack("<Q", ms * MS) + mpu + bytes(2) + bno + bytes(2)
        return body + struct.pack("<Q", sample * BNO_PERIOD_NS) + lisy + struct.pack("<H", self.battery_mv) + bytes(14)

    def hold(self, seconds: float) -> None:
        """Writes nothing for so long, then all at once: a late simulation."""
        self._free.clear()
        time.sleep(seconds)
        self._free.set()

    def stop(self) -> None:
        """The simulation dies: neither images nor heartbeat."""
        self._end.set()
        self._thread.join()

    def register(self, chip: str, number: int) -> int:
        """What the board has configured; chip is mpu, bno0 or bno1."""
        return self.map[{"mpu": 64, "bno0": 192, "bno1": 320}[chip] + number]

    @property
    def writes(self) -> int:
        """Configuration writes that the board has counted."""
        return int(struct.unpack_from("<Q", self.map, 32)[0])

    def _run(self) -> None:
        while not self._end.is_set():
            self._free.wait()
            self.advance()
            time.sleep(0.001)
