"""The sensor bus: a memory-mapped file through which the simulated chips reach the firmware's host board.

Layout in docs/architecture.md. This side writes images and the heartbeat and reads back the configuration registers.
"""

from __future__ import annotations

import mmap
import os
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gsense_rig.exclusive import own, release
from gsense_rig.sensors.chip_config import BnoConfig, ChipConfig, MpuConfig
from gsense_rig.sensors.layout import Registers

MAGIC = b"GSNSBUS1"
CAPACITY = 256
IMAGE_SIZE = 128
IMAGES_AT = 512
CONFIG_AT = 64
FILE_SIZE = IMAGES_AT + CAPACITY * IMAGE_SIZE

IMAGE = np.dtype(
    {
        "names": ["time", "mpu", "bno", "bno_temperature", "bno_calibration", "bno_time", "lisy", "battery"],
        "formats": ["<u8", (">i2", 7), ("<i2", 22), "i1", "u1", "<u8", ("<u2", 16), "<u2"],
        "offsets": [0, 8, 24, 68, 69, 72, 80, 112],
        "itemsize": IMAGE_SIZE,
    }
)
"""One image: what the chips' registers hold at one instant."""
BNO_CALIBRATED = 0xFF
_NS = 1e9


def default_bus_path() -> Path:
    """One bus for each user and ROS domain."""
    return Path(f"/tmp/gsense-bus-{os.getuid()}-{os.environ.get('ROS_DOMAIN_ID') or 0}")  # noqa: S108


def images(registers: Registers, *, fused: bool) -> npt.NDArray[np.void]:
    """Registers of n steps as images; `fused`: the BNO055 reports its calibration."""
    block = np.zeros(registers.time.shape[0], dtype=IMAGE)
    block["time"] = np.rint(registers.time * _NS)
    block["mpu"] = registers.mpu
    block["bno"] = registers.bno
    block["bno_temperature"] = registers.bno_temperature
    block["bno_calibration"] = BNO_CALIBRATED if fused else 0
    block["bno_time"] = np.rint(registers.bno_time * _NS)
    block["lisy"] = registers.lisy
    block["battery"] = registers.battery
    return block


class SensorBus:
    """The writer's end. Creates the file under a temporary name and renames it, so that no reader sees half of it.

    Raises:
        ValueError: another simulation writes this file; one line.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if _is_taken(path):
            raise ValueError(
                f"{path} is the sensor bus of another simulated rig that runs; give each rig its own, "
                "by the parameter bus here and --bus at its board"
            )
        temporary = path.with_name(f"{path.name}.{os.getpid()}")
        self._file = temporary.open("w+b")
        own(self._file)
        self._file.truncate(FILE_SIZE)
        self._map = mmap.mmap(self._file.fileno(), FILE_SIZE)
        self._inode = os.fstat(self._file.fileno()).st_ino
        self._map[0:8] = MAGIC
        self._map[8:16] = np.array([CAPACITY, IMAGE_SIZE], dtype="<u4").tobytes()
        self._head = np.frombuffer(self._map, dtype="<u8", count=3, offset=16)
        self._config = np.frombuffer(self._map, dtype=np.uint8, count=384, offset=CONFIG_AT)
        self._images = np.frombuffer(self._map, dtype=IMAGE, count=CAPACITY, offset=IMAGES_AT)
        self._writes_seen = 0
        temporary.replace(path)

    @property
    def count(self) -> int:
        """Images written so far."""
        return int(self._head[0])

    def write(self, block: npt.NDArray[np.void], heartbeat_ns: int) -> None:
        """Appends n images. The count is stored last: x86 and Python's interpreter keep stores in order."""
        start = int(self._head[0])
        total = block.shape[0]
        kept = block[-CAPACITY:]
        slots = (start + total - kept.shape[0] + np.arange(kept.shape[0])) % CAPACITY
        self._images[slots] = kept
        self._head[1] = heartbeat_ns
        self._head[0] = start + total

    def configuration(self) -> ChipConfig | None:
        """What the board has configured since the last call; None where nothing changed."""
        writes = int(self._head[2])
        if writes == self._writes_seen:
            return None
        self._writes_seen = writes
        registers = self._config.tolist()
        return ChipConfig(
            mpu=MpuConfig.from_registers(registers[:128]),
            bno=BnoConfig.from_registers(registers[128:256], registers[256:384]),
        )

    def close(self) -> None:
        """Removes the file, unless another simulation has put its own there."""
        try:
            if self.path.stat().st_ino == self._inode:
                self.path.unlink()
        except FileNotFoundError:
            pass
        release(self._file)
        self._file.close()


def _is_taken(path: Path) -> bool:
    """Whether a living simulation holds the file."""
    try:
        with path.open("rb") as file:
            return not own(file)
    except OSError:
        return False  # none there; whether one can be made is seen next
