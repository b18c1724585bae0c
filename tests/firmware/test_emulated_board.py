"""The hex for the real chip, run unmodified by the emulator: time budget, frames on the air, faults."""

from __future__ import annotations

import json
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from tests.firmware.build import build, build_folder
from tests.firmware.host_board import FAILED, MPU, STATUS, Frame, lost, of_type, uncobs

from gsense_driver.pipeline import Pipeline, PipelineSettings
from gsense_driver.transport import transport_delay

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

FAST, DEFAULT = "board_fast.hex", "board.hex"  # 500 + 100 Hz; 200 + 100 Hz
SECONDS = 8.0
WORST_US = 2000.0
MPU_ADDRESS, BNO_ADDRESS = 0x68, 0x28
HEARD_AFTER_S = 294.5e-6  # a frame is received, after the radio has it: settling and 329 bits at 2 Mbit/s
POWER_ON = 1
BNO_PERIOD_NS = 10_030_000  # of the emulated one: its own clock, 0.3 % slow
ADDRESS_NS = 60_000  # from START to the address of a read, when the chip takes its sample

FAULTS: dict[str, tuple[str, ...]] = {
    "sda_low": ("--sda-low", "3:1"),
    "sda_clocked_free": ("--sda-low", "3:0"),
    "stretch": ("--stretch", "3:0.02"),
    "absent": ("--mpu-absent", "3:0.3"),
    "deaf": ("--deaf", "3:0.3"),
    "radio_stuck": ("--radio-stuck", "3:0.3"),
    "radio_reset": ("--radio-reset", "3"),
    "brownout": ("--brownout", "3"),
    "hang": ("--hang", "3"),
    "air": ("--air-loss", "0.2"),
}


@dataclass
class Run:
    report: dict[str, Any]
    code: int
    heard: list[tuple[int, Frame]]
    """When a frame was heard (ns of true time), and what."""
    bursts: list[tuple[int, int, int, bytes]]
    """What the sensors gave: ns of the START, address, register, bytes."""
    serial: bytes
    text: str

    @property
    def frames(self) -> list[Frame]:
        return [frame for _, frame in self.heard]


@pytest.fixture(scope="session")
def emulator(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = build_folder("firmware-emulator", tmp_path_factory.mktemp("emulator"))
    plain = ("-DGSENSE_SANITIZE=OFF", "-DGSENSE_COVERAGE=OFF", "-DCMAKE_BUILD_TYPE=Release")
    return build(folder, *plain) / "emulator" / "gsense_pic"


def run(emulator: Path, folder: Path, program: Path, *arguments: str, seconds: float = SECONDS) -> Run:
    folder.mkdir(parents=True, exist_ok=True)
    names = {name: folder / name for name in ("json", "frames", "bursts", "serial")}
    command = [str(emulator), str(program), "--map", str(program.with_suffix(".map")), "--seconds", str(seconds)]
    command += [word for name, path in names.items() for word in (f"--{name}", str(path))]
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode in (0, 1), done.stderr
    heard = [line.split() for line in names["frames"].read_text().splitlines()]
    bursts = [line.split() for line in names["bursts"].read_text().splitlines()]
    return Run(
        json.loads(names["json"].read_text()),
        done.returncode,
        [(int(ns), Frame(bytes.fromhex(text))) for ns, text in heard],
        [(int(ns), int(at, 16), int(reg, 16), bytes.fromhex(text)) for ns, at, reg, text in bursts],
        names["serial"].read_bytes(),
        done.stdout,
    )


@pytest.fixture(scope="module")
def board(emulator: Path, pic_hex: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run(emulator, tmp_path_factory.mktemp("board"), pic_hex / FAST, "--profile")


@pytest.fixture(scope="module")
def receiver(emulator: Path, pic_hex: Path, tmp_path_factory: pytest.TempPathFactory) -> Run:
    return run(emulator, tmp_path_factory.mktemp("receiver"), pic_hex / "receiver.hex", "--receiver", seconds=5)


@pytest.fixture(scope="module")
def faulty(emulator: Path, pic_hex: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Run]:
    folder = tmp_path_factory.mktemp("faulty")
    with ThreadPoolExecutor(2) as pool:
        jobs = {
            name: pool.submit(run, emulator, folder / name, pic_hex / FAST, *arguments)
            for name, arguments in FAULTS.items()
        }
        return {name: job.result() for name, job in jobs.items()}


def within_budget(got: Run, mpu_period_us: int) -> None:
    print(got.text)
    report = got.report
    assert got.code == 0, report["fault"]
    assert (report["mpu_period_us"], report["bno_period_us"]) == (mpu_period_us, 10000)
    assert report["worst_us"] < WORST_US
    assert report["overruns"] == report["lost"] == report["unsound"] == report["failed"] == 0
    assert report["strays"] == report["bus_misuse"] == report["adc_rushed"] == report["bad_opcodes"] == 0
    assert report["stack"] <= 16
    assert report["resets"] == {**dict.fromkeys(report["resets"], 0), "power_on": 1}
    assert report["mpu"] > 0.98e6 / mpu_period_us * (SECONDS - 1)
    assert report["bno"] > 98 * (SECONDS - 1.5)  # 0.7 s until the BNO055 runs


def test_time_budget_of_the_fast_profile(board: Run) -> None:
    within_budget(board, 2000)


def test_time_budget_of_the_default_profile(emulator: Path, pic_hex: Path, tmp_path: Path) -> None:
    within_budget(run(emulator, tmp_path, pic_hex / DEFAULT), 5000)


def test_every_frame_is_sound_and_in_order(board: Run) -> None:
    assert all(frame.sound for frame in board.frames)
    assert lost(board.frames) == 0
    assert board.frames[0].sequence == 0
    assert board.frames[0].type == STATUS


def test_driver_reads_the_frames(board: Run) -> None:
    pipeline = Pipeline(PipelineSettings())
    for ns, frame in board.heard:
        pipeline.feed(cobs(frame.raw), ns)
    counts = vars(pipeline.link.counts)
    assert counts["received"] == len(board.frames)
    assert counts["lost"] == counts["corrupt"] == counts["duplicate"] == counts["restarts"] == 0


def cobs(raw: bytes) -> bytes:
    return b"".join(bytes((len(part) + 1,)) + part for part in raw.split(b"\0")) + b"\0"


def test_frames_hold_what_the_sensors_gave_at_their_time(board: Run) -> None:
    """Each MPU and BNO frame holds one of the bursts byte by byte, and its time is the true one of that read."""
    mpu = {data: ns for ns, address, reg, data in board.bursts if (address, reg) == (MPU_ADDRESS, 0x3B)}
    bno = {
        ns / 1000: data
        for ns, address, reg, data in board.bursts
        if (address, reg, len(data)) == (BNO_ADDRESS, 0x08, 18)
    }
    early = []
    for frame in of_type(board.frames, MPU):
        early.append(mpu[frame.raw[8:22]] / 1000 - frame.time_us)
        assert 511 * 16 < frame.get("<H", 22) < 513 * 16  # LISY300 at rest
        assert abs(frame.get("<H", 24) - 3900) <= 4  # mV: a code of the battery's is 6.4
    offset = min(early)  # between the START and the reading of the timer; and the timer's own start
    assert max(early) - offset < 60
    for frame in of_type(board.frames, 2):
        at = min(bno, key=lambda us: abs(us - frame.time_us - offset))
        assert abs(at - frame.time_us - offset) < 150
        assert frame.raw[8:26] == bno[at]


def age_errors(got: Run) -> list[float]:
    """Age of a BNO sample as its frame tells it, minus the true one, in ms; from 3 s on, when the clock is tracked."""
    reads = {data: ns for ns, address, reg, data in got.bursts if (address, reg, len(data)) == (BNO_ADDRESS, 0x08, 18)}
    errors = []
    for ns, frame in got.heard:
        if frame.type == 2 and ns > 3e9:
            true = (reads[frame.raw[8:26]] + ADDRESS_NS) % BNO_PERIOD_NS - ADDRESS_NS
            error = frame.get("<H", 28) * 1000 - true
            errors.append(((error + BNO_PERIOD_NS / 2) % BNO_PERIOD_NS - BNO_PERIOD_NS / 2) / 1e6)
    return errors


@pytest.mark.parametrize(("name", "most_ms"), [(DEFAULT, 0.45), (FAST, 1.6)])
def test_ages_of_bno_samples(emulator: Path, pic_hex: Path, tmp_path: Path, name: str, most_ms: float) -> None:
    """Its slots leave few chances to look in the fast profile; the bounds are what was found, with a margin."""
    errors = age_errors(run(emulator, tmp_path, pic_hex / name, seconds=20))
    mean = sum(errors) / len(errors)
    rms = (sum(error**2 for error in errors) / len(errors)) ** 0.5
    print(f"{name}: BNO ages off by {rms:.2f} ms RMS, {mean:.2f} ms on average, over {len(errors)} frames")
    assert len(errors) > 1600
    assert rms < most_ms


def test_receiver_passes_every_frame_on(receiver: Run) -> None:
    print(receiver.text)
    assert receiver.code == 0, receiver.report["fault"]
    packets = receiver.serial.split(b"\0")[:-1]
    assert [uncobs(packet) for packet in packets] == [frame.raw for frame in receiver.frames]
    assert len(packets) > 2200  # 600 frames/s, from 1 s on
    assert receiver.report["line"]["longest_ms"] < 3


def test_receiver_keeps_up_with_its_target_at_least(emulator: Path, pic_hex: Path, tmp_path: Path) -> None:
    got = run(emulator, tmp_path, pic_hex / "receiver.hex", "--receiver", "--frames-per-s", "700", seconds=3)
    assert got.code == 0, got.report["fault"]


def test_driver_knows_the_delay(board: Run, receiver: Run) -> None:
    """From the start of the MPU's read to the last serial byte: what `transport_delay` computes."""
    mpu = {data: ns for ns, address, reg, data in board.bursts if (address, reg) == (MPU_ADDRESS, 0x3B)}
    heard = sorted((ns - mpu[frame.raw[8:22]]) / 1e9 for ns, frame in board.heard if frame.type == MPU)
    assert heard[-1] - heard[0] < 200e-6
    line = receiver.report["line"]
    passed_on = (line["shortest_ms"] + line["longest_ms"]) / 2e3 - HEARD_AFTER_S
    delay = heard[len(heard) // 2] + passed_on
    print(f"MPU frame: heard after {heard[len(heard) // 2] * 1e3:.2f} ms, out after {delay * 1e3:.2f} ms")
    assert delay == pytest.approx(transport_delay(460800), abs=150e-6)


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_ends_in_recovery(faulty: dict[str, Run], name: str) -> None:
    got = faulty[name]
    print(got.text)
    assert got.report["strays"] == got.report["unsound"] == 0
    assert got.report["resets"]["stack_overflow"] == 0
    assert got.report["resets"]["watchdog"] == (1 if name == "hang" else 0)
    last = [frame for ns, frame in got.heard if ns > (SECONDS - 2) * 1e9]
    assert lost(last) <= (15 if name == "air" else 0)
    assert not any(frame.flags & FAILED for frame in last)
    assert len(of_type(last, MPU)) > 960
    assert len(of_type(last, 2)) > 190


def between(got: Run, first: float, last: float) -> list[Frame]:
    return [frame for ns, frame in got.heard if first * 1e9 < ns < last * 1e9]


def test_a_dead_bus_flags_its_frames(faulty: dict[str, Run]) -> None:
    dead = of_type(between(faulty["sda_low"], 3.02, 3.98), MPU)
    assert len(dead) > 400
    assert all(frame.flags & FAILED and frame.raw[8:22] == bytes(14) for frame in dead)
    assert faulty["sda_low"].report["lost"] == 0
    assert of_type(faulty["sda_low"].frames, MPU)[-1].get("<B", 27) > 20  # I2C errors, as the frames tell


def test_a_chip_that_holds_sda_is_clocked_free(faulty: dict[str, Run]) -> None:
    assert faulty["sda_clocked_free"].report["failed"] <= 1
    assert of_type(faulty["sda_clocked_free"].frames, MPU)[-1].get("<B", 27) == 1


def test_a_stretched_clock_ends_at_the_deadline(faulty: dict[str, Run]) -> None:
    assert 4 <= of_type(faulty["stretch"].frames, MPU)[-1].get("<B", 27) <= 16  # 2.5 ms each at most, within 20 ms


def test_an_absent_chip_is_set_up_anew(faulty: dict[str, Run]) -> None:
    gone = of_type(between(faulty["absent"], 3.02, 3.28), MPU)
    assert len(gone) > 100
    assert all(frame.flags & FAILED for frame in gone)
    assert of_type(between(faulty["absent"], 3.4, 3.8), STATUS)  # at the end of the set-up
    assert not any(frame.flags & FAILED for frame in of_type(between(faulty["absent"], 3.8, 9), MPU))


@pytest.mark.parametrize(
    ("name", "least", "most"), [("deaf", 100, 220), ("radio_stuck", 150, 320), ("radio_reset", 1, 650)]
)
def test_lost_frames_are_given_up_and_counted(faulty: dict[str, Run], name: str, least: int, most: int) -> None:
    got = faulty[name]
    assert least <= got.report["lost"] <= most
    assert got.report["lost"] == lost(got.frames)
    if name == "deaf":  # each of them by MAX_RT, told in the frames (the counter stays at 255)
        assert of_type(got.frames, MPU)[-1].get("<B", 26) == got.report["lost"]


@pytest.mark.parametrize(("name", "kind", "cause"), [("brownout", "brown_out", 2), ("hang", "watchdog", 3)])
def test_a_reset_is_told_with_its_cause(faulty: dict[str, Run], name: str, kind: str, cause: int) -> None:
    got = faulty[name]
    assert got.report["restarts"] == got.report["resets"][kind] == 1
    causes = [frame.raw[18] for frame in of_type(got.frames, STATUS)]
    assert (causes[0], causes[-1]) == (POWER_ON, cause)
    assert between(got, 3.0, 4.0)  # on the air again within a second


def test_a_slot_that_is_too_long_fails(emulator: Path, pic_hex: Path, tmp_path: Path) -> None:
    got = run(emulator, tmp_path, pic_hex / FAST, "--worst-us", "500", seconds=2)
    assert (got.code, got.report["fault"]) == (1, "a slot is too long")
