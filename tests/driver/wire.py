"""An encoder of its own for tests: frames and packets by the interface document, sharing no code with the driver."""

import struct
from collections.abc import Callable


def _shift(byte: int) -> int:
    crc = byte << 8
    for _ in range(8):
        crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


_TABLE = [_shift(byte) for byte in range(256)]


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc << 8 & 0xFFFF) ^ _TABLE[crc >> 8 ^ byte]
    return crc


def cobs(data: bytes) -> bytes:
    """COBS for less than 254 bytes, with the closing zero."""
    return b"".join(bytes([len(piece) + 1]) + piece for piece in data.split(b"\0")) + b"\0"


def payload(kind: int, sequence: int, time_us: int, body: bytes, flags: int = 0, version: int = 1) -> bytes:
    head = struct.pack("<BBHI", version << 5 | kind, flags, sequence % 65536, time_us % 2**32) + body.ljust(22, b"\0")
    return head + struct.pack("<H", crc16(head))


def mpu_body(acc=(0, 0, 8192), gyr=(0, 0, 0), temperature=0, lisy=8192, battery_mv=3900, i2c_errors=0) -> bytes:
    registers = struct.pack(">7h", *acc, temperature, *gyr)
    return registers + struct.pack("<HHBBBB", lisy, battery_mv, 0, i2c_errors, 0, 0)


def bno_body(acc=(0, 0, 981), mag=(320, 0, -640), gyr=(0, 0, 0), calib=0x3C, temperature=25, age_us=0) -> bytes:
    return struct.pack("<9hBbH", *acc, *mag, *gyr, calib, temperature, age_us)


def ndof_body(quaternion=(16384, 0, 0, 0), linear=(0, 0, 0), calib=0xFF, temperature=25) -> bytes:
    return struct.pack("<10hBb", 0, 0, 0, *quaternion, *linear, calib, temperature)


def status_body(
    dlpf=3, fs_sel=1, afs_sel=1, opr_mode=7, acc_config=0x0D, gyr_config=0x38, unit_sel=0, uptime=0
) -> bytes:
    head = (0, 2, dlpf, fs_sel << 4 | afs_sel, 4, opr_mode, acc_config, gyr_config, 0, 0x0B, 1, unit_sel)
    return struct.pack("<12BHHIH", *head, 5000, 10000, uptime, 0)


class Board:
    """Plays a board: frames at 200 + 100 + 1 Hz, or so much slower, as (true time s, payload) in order."""

    def __init__(
        self, start_us: int = 0, skew: float = 0.0, mpu: Callable[[float], bytes] | None = None, slower: int = 1
    ) -> None:
        self.start_us = start_us
        self.skew = skew
        self.slower = slower
        self.mpu = mpu or (lambda _t: mpu_body())

    def frames(self, duration: float, begin: float = 0.0) -> list[tuple[float, bytes]]:
        out = []
        sequence = 0
        for slot in range(round(duration * 200 / self.slower)):
            t = slot * 0.005 * self.slower
            due = [(1, t, self.mpu(t))]
            if slot % 2:
                due.append((2, t + 0.002, bno_body(gyr=(slot % 7, slot % 11, slot % 13))))
            if slot % (200 // self.slower) == 100 // self.slower:
                due.append((3, t + 0.004, status_body(uptime=int(t))))
            for kind, when, body in due:
                board_us = self.start_us + round(when * (1 + self.skew) * 1e6)
                flags = 2 if when < 1.0 and self.start_us == 0 else 0
                out.append((begin + when, payload(kind, sequence, board_us, body, flags)))
                sequence += 1
        return out
