"""Injected faults: what the driver counts from the serial line equals what the board says it did."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from tests.firmware.host_board import FAILED, MPU, STATUS, Frame, HostBoard, of_type, uncobs

from gsense_driver.pipeline import Pipeline, PipelineSettings

SECONDS = "4.2"
AT_ONCE = 7  # boards; all of them would starve one another on a small machine
READ_EVERY = 0.01  # s; to be woken by each packet of seven boards would starve them
LONG = 1.0  # s of a fault that lasts

CASES: dict[str, tuple[str, ...]] = {
    "none": (),
    "lose": ("--lose", "0.05"),
    "lose_again": ("--lose", "0.05"),
    "air": ("--air-loss", "0.4", "--profile", "fast"),
    "repeat": ("--repeat", "0.1"),
    "flip": ("--flip", "0.05"),
    "brownout": ("--brownout", "3", "--skew-ppm", "50"),
    "radio_stuck": ("--radio-stuck", "2:0.3"),
    "radio_reset": ("--radio-reset", "2"),
    "bursts": ("--latency-bursts", "16", "--real-delay", "--skew-ppm", "-50"),
    "sda_low": ("--sda-low", f"2:{LONG}"),
    "sda_clocked_free": ("--sda-low", "2:0"),
    "stretch": ("--stretch", "2:0.02"),
    "all": (
        *("--lose", "0.03", "--repeat", "0.05", "--flip", "0.05", "--air-loss", "0.1", "--brownout", "3"),
        *("--latency-bursts", "16", "--radio-stuck", "2:0.1", "--seed", "5"),
    ),
}


@dataclass
class Run:
    """A board's whole output, the driver's counts, and the truth."""

    frames: list[Frame]
    counts: dict[str, int]
    clock_steps: int
    """Restarts that the driver supposed since frames kept coming late."""
    delay_us: float
    """By how much the slowest frame came later than the quickest: the machine held up the board or us."""
    truth: dict[str, Any]
    said: str


def run(binary: Path, truth: Path, *arguments: str) -> Run:
    command = ["--bus", str(truth.parent / "none"), "--truth", str(truth), "--duration", SECONDS, *arguments]
    pieces: list[tuple[int, bytes]] = []
    with HostBoard(binary, *command) as board:
        line = os.open(board.port, os.O_RDONLY | os.O_NOCTTY)
        with contextlib.suppress(OSError):  # EIO: the board has closed its end
            while piece := os.read(line, 4096):
                pieces.append((time.monotonic_ns(), piece))
                time.sleep(READ_EVERY)
        os.close(line)
        assert board.end() == 0
    pipeline = Pipeline(PipelineSettings())
    for arrival_ns, piece in pieces:
        pipeline.feed(piece, arrival_ns)
    arrivals = list(arrived(pieces))
    return Run(
        [frame for _, frame in arrivals],
        vars(pipeline.link.counts),
        pipeline.clock.steps,
        slowest(arrivals),
        json.loads(truth.read_text()),
        "".join(board.said),
    )


def arrived(pieces: list[tuple[int, bytes]]) -> Iterator[tuple[float, Frame]]:
    """The sound frames with the times (us) at which they were whole."""
    pending = b""
    for arrival_ns, piece in pieces:
        *packets, pending = (pending + piece).split(b"\0")
        yield from ((arrival_ns / 1000, frame) for frame in map(Frame, map(uncobs, packets)) if frame.sound)


def slowest(arrivals: list[tuple[float, Frame]]) -> float:
    """The largest difference of the delays (us) of frames between which the board did not start anew."""
    most, least, newest_us = 0.0, float("inf"), 0
    for arrival_us, frame in arrivals:
        if frame.time_us < newest_us - 500_000:
            least = float("inf")
        newest_us = frame.time_us
        least = min(least, arrival_us - frame.time_us)
        most = max(most, arrival_us - frame.time_us - least)
    return most


@pytest.fixture(scope="module")
def runs(firmware_build: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Run]:
    folder = tmp_path_factory.mktemp("faults")
    with ThreadPoolExecutor(AT_ONCE) as pool:
        jobs = {
            name: pool.submit(run, firmware_build / "gsense_board", folder / f"{name}.json", *arguments)
            for name, arguments in CASES.items()
        }
        return {name: job.result() for name, job in jobs.items()}


@pytest.mark.parametrize("name", CASES)
def test_driver_counts_what_was_injected(runs: dict[str, Run], name: str) -> None:
    got = runs[name]
    print(got.counts, got.clock_steps, f"{got.delay_us:.0f} us", got.truth)
    assert (got.truth["unsent"], got.truth["unread"]) == (0, 0)
    assert got.counts["received"] > 500
    assert got.counts["reordered"] == 0
    for count in ("received", "lost", "corrupt", "duplicate"):
        assert got.counts[count] == got.truth[count], count
    assert got.counts["restarts"] - got.clock_steps == got.truth["restarts"]
    assert got.clock_steps == 0 or got.delay_us > 50_000


def test_every_fault_struck(runs: dict[str, Run]) -> None:
    assert all(runs["none"].truth[count] == 0 for count in ("corrupt", "duplicate", "restarts"))
    assert runs["none"].truth["lost"] == runs["none"].truth["dropped"]  # none, where the machine lets us read in time
    assert runs["lose"].truth["lost"] > 10
    assert runs["lose"].truth["radio"]["given_up"] >= runs["lose"].truth["lost"] - runs["lose"].truth["dropped"]
    assert runs["air"].truth["air"]["attempts"] > 1.3 * runs["air"].truth["air"]["frames"]
    assert runs["air"].truth["lost"] > 5
    assert runs["repeat"].truth["duplicate"] > 30
    assert runs["flip"].truth["corrupt"] > 15
    assert runs["brownout"].truth["restarts"] == 1
    everything = runs["all"].truth
    assert all(everything[count] > 0 for count in ("lost", "corrupt", "duplicate", "restarts"))


def test_a_brown_out_is_told_as_the_cause(runs: dict[str, Run]) -> None:
    causes = [frame.raw[18] for frame in of_type(runs["brownout"].frames, STATUS)]
    assert causes[0] == 1  # power on
    assert causes[-1] == 2  # brown-out


def test_a_stuck_radio_is_set_up_anew_and_sends_again(runs: dict[str, Run]) -> None:
    got = runs["radio_stuck"]
    assert got.truth["radio"]["stuck"] >= 2
    assert got.truth["radio"]["restarts"] >= 1
    assert 60 <= got.truth["lost"] - got.truth["dropped"] <= 150  # 300 frames/s for 0.3 s, and the set-up
    assert of_type(got.frames, MPU)[-1].get("<B", 26) >= 60  # given up, as the frames tell


def test_a_radio_that_lost_its_registers_is_found_within_a_second(runs: dict[str, Run]) -> None:
    got = runs["radio_reset"]
    assert got.truth["radio"]["restarts"] >= 1
    assert 1 <= got.truth["lost"] - got.truth["dropped"] <= 330
    assert of_type(got.frames, MPU)[-1].time_us > 3_200_000


def test_a_dead_i2c_bus_fails_reads_and_comes_back(runs: dict[str, Run]) -> None:
    got = runs["sda_low"]
    assert got.truth["lost"] == got.truth["dropped"]
    assert got.truth["i2c"]["recoveries"] == got.truth["i2c"]["errors"] > 20
    assert got.truth["i2c"]["stuck"] > 20
    mpu = of_type(got.frames, MPU)
    dead = [frame for frame in mpu if 2_010_000 < frame.time_us < 2_990_000]
    assert len(dead) > 150
    assert all(frame.flags & FAILED for frame in dead)
    assert all(frame.raw[8:22] == bytes(14) for frame in dead)
    alive = [frame for frame in mpu if frame.time_us > 3_300_000]
    assert len(alive) > 50
    assert not any(frame.flags & FAILED for frame in alive)


def test_a_chip_that_holds_sda_is_clocked_free(runs: dict[str, Run]) -> None:
    got = runs["sda_clocked_free"]
    assert got.truth["i2c"] == {"errors": 1, "timeouts": 0, "recoveries": 1, "stuck": 0}
    assert sum(bool(frame.flags & FAILED) for frame in of_type(got.frames, MPU)) <= 1


def test_a_stretched_clock_ends_at_the_deadline(runs: dict[str, Run]) -> None:
    got = runs["stretch"]
    assert 4 <= got.truth["i2c"]["timeouts"] <= 10  # 2.5 ms each, within 20 ms
    assert not any(frame.flags & FAILED for frame in of_type(got.frames, MPU)[-50:])


def test_same_seed_same_faults(runs: dict[str, Run]) -> None:
    """The same frames are missing, but for those that either board dropped because we were late in reading."""
    first, second = runs["lose"], runs["lose_again"]
    heard = [{frame.sequence for frame in got.frames} for got in (first, second)]
    missing = [set(range(min(map(max, heard)))) - numbers for numbers in heard]
    assert len(missing[0] & missing[1]) > 10
    assert len(missing[0] - missing[1]) <= first.truth["dropped"]
    assert len(missing[1] - missing[0]) <= second.truth["dropped"]


def test_truth_upon_request(firmware_build: Path, tmp_path: Path) -> None:
    path = tmp_path / "truth.json"
    with HostBoard(firmware_build / "gsense_board", "--bus", str(tmp_path / "none"), "--truth", str(path)) as board:
        board.read(0.5)
        board.process.send_signal(signal.SIGUSR1)
        end = time.monotonic() + 30
        while not path.exists() and time.monotonic() < end:
            time.sleep(0.02)
        assert json.loads(path.read_text())["schema"] == "gsense-truth/1"
        board.process.kill()  # its end would wait for a reader


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--sda-low", "3"), "--sda-low takes AT:DURATION in seconds, not '3'"),
        (("--brownout", "x"), "--brownout takes AT in seconds, not 'x'"),
        (("--lose", "2"), "--lose takes a number from 0 to 1, not '2'"),
    ],
)
def test_bad_fault_options(firmware_build: Path, arguments: tuple[str, ...], said: str) -> None:
    command = [str(firmware_build / "gsense_board"), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert said in done.stderr
