"""The host board as a process: what a reader of its pseudo-terminal gets."""

from __future__ import annotations

import contextlib
import os
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from tests.firmware.bus_writer import BNO_PERIOD_NS, BusWriter
from tests.firmware.host_board import (
    BNO,
    FAILED,
    LOW,
    MPU,
    NDOF,
    STARTED,
    STATUS,
    Frame,
    HostBoard,
    lost,
    of_type,
    uncobs,
    uneven,
)


@pytest.fixture
def binary(firmware_build: Path) -> Path:
    return firmware_build / "gsense_board"


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[BusWriter]:
    writer = BusWriter(tmp_path / "bus")
    yield writer
    writer.stop()


def wait_until(what: str, condition: object, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():  # type: ignore[operator]
        assert time.monotonic() < end, f"no {what} within {seconds} s"
        time.sleep(0.02)


def test_bench_streams_without_loss(binary: Path, tmp_path: Path) -> None:
    with HostBoard(binary, "--bus", str(tmp_path / "none")) as board:
        frames = board.read_until(lambda frames: len(of_type(frames, MPU)) > 400)
        assert board.end() == 0
    assert all(frame.sound for frame in frames)
    assert lost(frames) <= board.missed
    mpu, bno = of_type(frames, MPU), of_type(frames, BNO)
    assert uneven(mpu, 5000) <= board.missed
    assert uneven(bno, 10000) <= board.missed
    assert len(bno) > 150
    assert not any(frame.flags & (FAILED | LOW) for frame in frames)
    assert {bool(frame.flags & STARTED) for frame in mpu} == {True, False}
    assert statistics.mean(frame.get(">h", 12) for frame in mpu) == pytest.approx(8192, abs=10)  # 1 g on z
    assert mpu[-1].get(">h", 14) / 340 + 36.53 == pytest.approx(25, abs=0.5)
    assert mpu[-1].get("<H", 22) * 3.3 / 16384 == pytest.approx(1.65, abs=0.02)
    assert mpu[-1].get("<H", 24) == pytest.approx(3900, abs=5)
    assert statistics.mean(frame.get("<h", 12) for frame in bno) == pytest.approx(981, abs=2)
    assert any("lying still" in line for line in board.said)


def test_no_frame_comes_before_its_board_time(binary: Path, tmp_path: Path) -> None:
    """By the least delay of a type, which a loaded machine only makes longer; jobs of a slot add up to 0.9 ms."""
    least: dict[int, float] = {}  # in the order of arrival
    pending = b""
    with HostBoard(binary, "--bus", str(tmp_path / "none"), "--duration", "3.5") as board:
        line = os.open(board.port, os.O_RDONLY | os.O_NOCTTY)
        with contextlib.suppress(OSError):  # EIO: the board has closed its end
            while piece := os.read(line, 4096):
                arrival_us = time.monotonic_ns() / 1000
                *packets, pending = (pending + piece).split(b"\0")
                for frame in map(Frame, map(uncobs, packets)):
                    least[frame.type] = min(arrival_us - frame.time_us, least.get(frame.type, float("inf")))
        os.close(line)
    print({kind: round(delay - least[MPU]) for kind, delay in least.items()})
    assert set(least) == {MPU, BNO, STATUS}
    assert next(iter(least)) == STATUS
    assert all(delay > least[MPU] - 400 for delay in least.values())


def test_fast_profile_and_ndof(binary: Path, tmp_path: Path) -> None:
    with HostBoard(binary, "--bus", str(tmp_path / "none"), "--profile", "fast", "--bno", "ndof") as board:
        frames = board.read_until(lambda frames: len(of_type(frames, NDOF)) > 100)
    assert all(frame.sound for frame in frames)
    assert lost(frames) <= board.missed
    assert len(of_type(frames, MPU)) > 400
    assert uneven(of_type(frames, MPU), 2000) <= board.missed
    assert uneven(of_type(frames, NDOF), 10000) <= board.missed
    assert not of_type(frames, BNO)


def test_clock_wraps_and_skews(binary: Path, tmp_path: Path) -> None:
    arguments = ("--bus", str(tmp_path / "none"), "--start-us", str(2**32 - 1_200_000), "--skew-ppm", "-50")
    with HostBoard(binary, *arguments) as board:
        frames = board.read_until(lambda frames: any(frame.time_us < 100_000 for frame in of_type(frames, MPU)))
    mpu = of_type(frames, MPU)
    assert lost(frames) <= board.missed
    assert uneven(mpu, 5000) <= board.missed
    assert mpu[0].time_us > 2**32 - 1_200_000


def test_same_seed_same_noise(binary: Path, tmp_path: Path) -> None:
    def bodies(seed: str) -> dict[int, bytes]:
        with HostBoard(binary, "--bus", str(tmp_path / "none"), "--seed", seed) as board:
            return {frame.time_us: frame.raw[8:22] for frame in of_type(board.read(1.0), MPU)}

    with ThreadPoolExecutor() as pool:
        noise = list(pool.map(bodies, ("7", "7", "8")))
    both = noise[0].keys() & noise[1].keys() & noise[2].keys()
    assert len(both) > 10
    assert all(noise[0][t] == noise[1][t] for t in both)
    assert any(noise[0][t] != noise[2][t] for t in both)


def test_time_is_not_bent_by_a_late_simulation(binary: Path, tmp_path: Path, bus: BusWriter) -> None:
    pauses = threading.Thread(target=hold_in_turn, args=(bus, (0.05, 0.15, 0.02)), daemon=True)
    with HostBoard(binary, "--bus", str(tmp_path / "bus"), "--no-bench") as board:
        board.read_until(lambda frames: any(not frame.flags & FAILED for frame in of_type(frames, MPU)))
        pauses.start()
        frames = board.read_until(lambda frames: len(learnt(frames)) > 150 and not pauses.is_alive())
        mpu = [frame for frame in of_type(frames, MPU) if not frame.flags & FAILED]
        assert all(frame.sound for frame in frames)
        # Image's millisecond minus board time is constant to the millisecond of the images.
        offsets = [(frame.get(">h", 8) * 1000 - frame.time_us) % (2**15 * 1000) for frame in mpu]
        assert max(offsets) - min(offsets) <= 1000
        assert mpu[0].get("<H", 22) == 16 * bus.lisy
        assert mpu[0].get("<H", 24) == pytest.approx(bus.battery_mv, abs=4)
        # A BNO sample's time as the board tells it, against the simulation's.
        errors = [
            frame.time_us - frame.get("<H", 28) - frame.get("<h", 20) * BNO_PERIOD_NS / 1000 for frame in learnt(frames)
        ]
        wrap = 2**16 * BNO_PERIOD_NS / 1000  # the image's count has 16 bits, and its zero may fall into the run
        errors = [(error - errors[0] + wrap / 2) % wrap - wrap / 2 for error in errors]
        print(f"age of the BNO sample: {statistics.pstdev(errors):.0f} us rms about its mean, {len(errors)} reads")
        assert statistics.pstdev(errors) < 1000
        assert bus.writes > 5
        assert [bus.register("mpu", number) for number in (0x19, 0x1A, 0x1B, 0x1C, 0x6B)] == [4, 3, 8, 8, 1]
        assert [bus.register("bno1", number) for number in (0x08, 0x09, 0x0A)] == [0x0D, 0x0B, 0x38]
        assert [bus.register("bno0", number) for number in (0x3B, 0x3D)] == [0, 7]
        assert board.end() == 0
        assert lost(frames) <= board.missed


def hold_in_turn(bus: BusWriter, pauses: tuple[float, ...]) -> None:
    for pause in pauses:
        bus.hold(pause)
        time.sleep(0.2)


def learnt(frames: list[Frame]) -> list[Frame]:
    """Those of the BNO055 after the 3 s in which the board finds the rhythm of its samples."""
    return [frame for frame in of_type(frames, BNO) if not frame.flags & FAILED and frame.time_us > 3_000_000]


def test_dead_simulation_gives_failed_reads_and_a_new_one_is_found(binary: Path, tmp_path: Path) -> None:
    path = tmp_path / "bus"
    with HostBoard(binary, "--bus", str(path)) as board:
        board.read_until(lambda frames: bool(of_type(frames, MPU)))  # bench first
        first = BusWriter(path)
        wait_until("pick-up of the bus", lambda: any("reads the sensor bus" in line for line in board.said))
        board.read_until(lambda frames: lisy(frames) == 16 * 300)
        first.stop()
        board.read_until(lambda frames: all_failed(frames[-30:]))
        assert all_failed(board.read_until(lambda frames: len(frames) > 60))
        second = BusWriter(path, lisy=700)
        board.read_until(lambda frames: lisy(frames) == 16 * 700)
        second.stop()


def all_failed(frames: list[Frame]) -> bool:
    """Of more than a few, all but the board's own STATUS."""
    return len(frames) > 20 and all(frame.flags & FAILED for frame in frames if frame.type != STATUS)


def lisy(frames: list[Frame]) -> int | None:
    """What the newest MPU frame that did not fail tells of the LISY300."""
    return next((frame.get("<H", 22) for frame in reversed(of_type(frames, MPU)) if not frame.flags & FAILED), None)


def test_without_bench_reads_fail(binary: Path, tmp_path: Path) -> None:
    with HostBoard(binary, "--bus", str(tmp_path / "none"), "--no-bench") as board:
        frames = board.read_until(lambda frames: len(of_type(frames, MPU)) > 300 and len(of_type(frames, BNO)) > 100)
    assert lost(frames) <= board.missed
    assert all(frame.flags & FAILED for frame in frames if frame.type != STATUS)


@pytest.mark.parametrize("content", [b"", b"GSNSBUS1", b"x" * 40000])
def test_a_file_that_is_no_bus_is_ignored(binary: Path, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "bus"
    path.write_bytes(content)
    with HostBoard(binary, "--bus", str(path), "--duration", "0.5") as board:
        assert board.process.wait(timeout=60) == 0
    assert any("lying still" in line for line in board.said)
    assert content == b"" or any("not a sensor bus" in line for line in board.said)


def test_nobody_reads_then_whole_packets_only(binary: Path, tmp_path: Path) -> None:
    with HostBoard(binary, "--bus", str(tmp_path / "none"), "--profile", "fast") as board:
        time.sleep(1.4)
        frames = board.read_until(lambda frames: len(frames) > 100)
        assert all(frame.sound for frame in frames)
        assert frames[0].sequence > 300  # the oldest are gone, not the newest
        again = board.read_until(lambda frames: len(frames) > 400)  # a reader may come back
        assert all(frame.sound for frame in again)
        assert board.end() == 0
    assert any("dropped for want of a reader" in line and " 0 dropped" not in line for line in board.said)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_link_is_made_and_removed(binary: Path, tmp_path: Path, how: signal.Signals) -> None:
    link = tmp_path / "board"
    with HostBoard(binary, "--bus", str(tmp_path / "none"), "--link", str(link)) as board:
        assert str(link.readlink()) == board.port
        board.process.send_signal(how)
        assert board.process.wait(timeout=60) == 0
    assert not link.is_symlink()


def test_link_of_another_board_is_left_alone(binary: Path, tmp_path: Path) -> None:
    link = tmp_path / "board"
    with HostBoard(binary, "--link", str(link)) as old, HostBoard(binary, "--link", str(link)) as new:
        assert str(link.readlink()) == new.port
        assert old.end() == 0
        assert str(link.readlink()) == new.port


def test_exits_with_its_parent_when_asked(binary: Path, tmp_path: Path) -> None:
    link = tmp_path / "board"
    script = (
        "import subprocess, sys\n"
        f"board = subprocess.Popen([{str(binary)!r}, '--exit-with-parent', '--link', {str(link)!r}], "
        "stdout=subprocess.PIPE)\n"
        "board.stdout.readline()\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True, timeout=60)
    wait_until("removal of the link", lambda: not link.is_symlink())


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--profile", "slow"), "--profile is default or fast, not 'slow'"),
        (("--skew-ppm", "x"), "--skew-ppm takes a number from -1000 to 1000, not 'x'"),
        (("--link", "/nowhere/board"), "/nowhere/board: No such file or directory"),
        (("extra",), "'extra' is not an option"),
    ],
)
def test_bad_arguments_are_said_in_one_line(binary: Path, arguments: tuple[str, ...], said: str) -> None:
    done = subprocess.run([binary, *arguments], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode in (1, 2)
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert said in done.stderr
