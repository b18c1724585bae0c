"""The sensor bus file as the firmware's host board sees it: read here by offset, not through the writer's classes."""

from __future__ import annotations

import os
import pickle
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from gsense_rig.sensors.bus import SensorBus, default_bus_path, images
from gsense_rig.sensors.live import LiveFeedSpec, make_live_feed
from gsense_rig.sensors.unit import SensorUnit, UnitSpec

CAPACITY, SIZE, AT = 256, 128, 512


def history(first_ms: int, count: int) -> np.ndarray:
    rows = np.zeros((count, 5))
    rows[:, 0] = (first_ms + np.arange(count)) * 1e-3
    return rows


def read_image(path: Path, number: int) -> bytes:
    return path.read_bytes()[AT + number % CAPACITY * SIZE :][:SIZE]


def head(path: Path) -> tuple[bytes, int, int, int, int, int]:
    return struct.unpack_from("<8sIIQQQ", path.read_bytes())


def set_registers(path: Path, registers: dict[int, int]) -> None:
    """As the board does: bytes at their offset, then the count of writes."""
    with path.open("r+b") as file:
        for offset, value in registers.items():
            file.seek(offset)
            file.write(bytes([value]))
        file.seek(32)
        (writes,) = struct.unpack("<Q", file.read(8))
        file.seek(32)
        file.write(struct.pack("<Q", writes + 1))


def test_layout_and_ring(tmp_path: Path) -> None:
    path = tmp_path / "bus"
    bus = SensorBus(path)
    unit = SensorUnit(UnitSpec())
    registers = unit.advance(history(5_000_000, 600))
    bus.write(images(registers, fused=False)[:100], 7)
    assert head(path) == (b"GSNSBUS1", CAPACITY, SIZE, 100, 7, 0)
    bus.write(images(registers, fused=False)[100:], 8)  # more than the ring holds
    assert head(path)[3:5] == (600, 8)
    for number in (599, 599 - 255):
        image = read_image(path, number)
        assert struct.unpack_from("<Q", image)[0] == (5_000_000 + number) * 1_000_000
        assert list(struct.unpack_from(">7h", image, 8)) == registers.mpu[number].tolist()
        assert list(struct.unpack_from("<22h", image, 24)) == registers.bno[number].tolist()
        assert struct.unpack_from("<bB", image, 68) == (registers.bno_temperature[number], 0)
        assert struct.unpack_from("<Q", image, 72)[0] == round(registers.bno_time[number] * 1e9)
        assert list(struct.unpack_from("<16H", image, 80)) == registers.lisy[number].tolist()
        assert struct.unpack_from("<H", image, 112)[0] == registers.battery[number]
    bus.close()
    assert not path.exists()


def test_two_buses_one_path(tmp_path: Path) -> None:
    """The newer one has the path; closing the older one does not take it away."""
    old = SensorBus(tmp_path / "bus")
    (tmp_path / "bus").unlink()  # by somebody who tidies /tmp
    new = SensorBus(tmp_path / "bus")
    old.close()
    assert (tmp_path / "bus").exists()
    new.close()
    assert list(tmp_path.iterdir()) == []


def test_the_boards_registers_are_obeyed(tmp_path: Path) -> None:
    path = tmp_path / "bus"
    feed = make_live_feed(LiveFeedSpec(UnitSpec(), path))
    feed.advance(history(0, 200))
    at_4_g = struct.unpack_from(">7h", read_image(path, 199), 8)
    set_registers(path, {64 + 0x1C: 0x00, 64 + 0x1B: 0x18, 64 + 0x1A: 1, 192 + 0x3D: 0x0C})
    feed.advance(history(200, 500))
    at_2_g = struct.unpack_from(">7h", read_image(path, 699), 8)
    assert at_4_g[2] == pytest.approx(9.81 / 9.80665 * 8192, rel=0.1)
    assert at_2_g[2] / at_4_g[2] == pytest.approx(2.0, rel=0.04)  # one noisy sample each
    assert at_2_g[4] / at_4_g[4] == pytest.approx(16.4 / 65.5, rel=0.2)  # the bias at +-2000 deg/s
    fused = read_image(path, 699)
    assert struct.unpack_from("<3h", fused, 24 + 0x26)[2] == pytest.approx(981, abs=3)  # gravity, registers 0x2E
    assert fused[69] == 0xFF
    set_registers(path, {64 + 0x6B: 0x40})  # sleep: the registers stay
    feed.advance(history(700, 100))
    assert read_image(path, 799)[8:22] == fused[8:22]
    feed.close()


def test_a_feed_in_another_process(tmp_path: Path) -> None:
    """The spec is picklable, and the heartbeat is CLOCK_MONOTONIC."""
    path = tmp_path / "bus"
    spec = tmp_path / "spec"
    spec.write_bytes(pickle.dumps(LiveFeedSpec(UnitSpec(effects=("bias=0.1",)), path)))
    code = (
        "import pickle,sys,numpy as np;from pathlib import Path;from gsense_rig.sensors.live import make_live_feed;"
        f"f=make_live_feed(pickle.loads(Path({str(spec)!r}).read_bytes()));h=np.zeros((300,5));"
        "h[:,0]=np.arange(300)*1e-3;f.advance(h)"
    )
    subprocess.run(
        [sys.executable, "-c", code], check=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    )
    _, _, _, count, heartbeat, _ = head(path)
    assert count == 300
    assert 0 < time.monotonic_ns() - heartbeat < 60e9
    gyro = struct.unpack_from(">3h", read_image(path, 299), 16)
    assert np.array(gyro) / 65.5 == pytest.approx([5.73] * 3, abs=0.6)


def test_default_path_names_user_and_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", "45")
    assert default_bus_path().name.endswith("-45")
    monkeypatch.delenv("ROS_DOMAIN_ID")
    assert default_bus_path().name.endswith("-0")


def test_a_call_of_the_live_feed_fits_into_a_control_period(tmp_path: Path) -> None:
    feed = make_live_feed(LiveFeedSpec(UnitSpec(), tmp_path / "bus"))
    costs = []
    for k in range(500):
        rows = history(2 * k, 2)
        begun = time.perf_counter()
        feed.advance(rows)
        costs.append(time.perf_counter() - begun)
    feed.close()
    assert np.median(costs) < 1e-3  # about 40 us on an idle machine


def test_a_second_simulation_may_not_take_a_bus_that_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gsense_rig.exclusive.PATIENCE", 0.1)
    path = tmp_path / "bus"
    holder = subprocess.Popen(
        [
            sys.executable,
            "-c",
            (
                "import sys; from pathlib import Path; from gsense_rig.sensors.bus import SensorBus\n"
                "bus = SensorBus(Path(sys.argv[1])); print('ready', flush=True); sys.stdin.read()"
            ),
            str(path),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    try:
        assert holder.stdout is not None
        assert holder.stdout.readline() == b"ready\n"
        with pytest.raises(ValueError, match="another simulated rig that runs"):
            SensorBus(path)
        assert head(path)[0] == b"GSNSBUS1"
    finally:
        holder.kill()
        holder.wait()
    SensorBus(path)  # killed, it left its file behind: that is no owner
