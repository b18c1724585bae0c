"""The C tests of core and receiver, their coverage, and the static check."""

from __future__ import annotations

import binascii
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest
from tests.firmware.build import FIRMWARE
from tests.firmware.host_board import uncobs

C_TESTS = (
    *("frame", "cobs", "scheduler", "sample_clock", "mpu6050", "bno055", "analogue", "i2c", "nrf24", "nrf24_faults"),
    *("receiver", "board", "board_faults", "emulator_buses", "emulator_core", "emulator_times"),
)


@pytest.fixture
def tests_folder(firmware_build: Path) -> Path:
    if not (firmware_build / "tests" / "golden_tool").exists():
        pytest.skip("cmocka is missing: apt-get install libcmocka-dev")
    return firmware_build


@pytest.mark.parametrize("name", C_TESTS)
def test_c(tests_folder: Path, name: str) -> None:
    done = subprocess.run([tests_folder / "tests" / f"test_{name}"], capture_output=True, text=True, check=False)
    output = done.stdout + done.stderr
    print(output)
    assert done.returncode == 0, output
    assert re.search(r"\[  PASSED  \] [1-9]\d* test", output)


def test_no_c_test_is_left_out() -> None:
    assert {file.stem for file in (FIRMWARE / "tests").glob("test_*.c")} == {f"test_{name}" for name in C_TESTS}


def test_core_is_covered(tests_folder: Path) -> None:
    gcov = shutil.which("gcov")
    if gcov is None:
        pytest.skip("gcov is missing (it comes with gcc)")
    for name in C_TESTS:
        subprocess.run([tests_folder / "tests" / f"test_{name}"], capture_output=True, check=True)
    data = sorted((tests_folder / "CMakeFiles" / "gsense_core.dir").rglob("*.gcda"))
    assert data
    done = subprocess.run([gcov, "-n", *map(str, data)], capture_output=True, text=True, check=True)
    found = re.findall(r"File '.*/core/(\w+\.c)'\nLines executed:([\d.]+)% of (\d+)", done.stdout)
    assert {name for name, _, _ in found} >= {file.name for file in (FIRMWARE / "core").glob("*.c")} - {"profiles.c"}
    lines = sum(int(count) for _, _, count in found)
    covered = sum(float(share) / 100 * int(count) for _, share, count in found)
    print(f"{covered:.0f} of {lines} lines of the core: {100 * covered / lines:.1f} %")
    assert covered / lines > 0.95


def test_golden_frames_agree_with_an_independent_crc() -> None:
    document = json.loads((FIRMWARE / "tests" / "golden_frames.json").read_text())
    assert document["schema"] == "gsense-golden-frames/1"
    assert {frame["type"] for frame in document["frames"]} == {1, 2, 3, 4}
    for frame in document["frames"]:
        raw, packet = bytes.fromhex(frame["hex"]), bytes.fromhex(frame["packet"])
        assert binascii.crc_hqx(raw[:30], 0xFFFF) == int.from_bytes(raw[30:], "little")
        assert packet[-1] == 0
        assert uncobs(packet[:-1]) == raw


def test_cppcheck() -> None:
    cppcheck = shutil.which("cppcheck")
    if cppcheck is None:
        pytest.skip("cppcheck is missing: apt-get install cppcheck")
    command = [cppcheck, "--enable=warning,style,performance,portability", "--std=c99", "--quiet", "--error-exitcode=1"]
    command += ["--suppress=missingIncludeSystem", f"-I{FIRMWARE / 'core'}", f"-I{FIRMWARE / 'receiver'}"]
    folders = [str(FIRMWARE / name) for name in ("core", "receiver", "hal")]
    done = subprocess.run([*command, *folders], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_misra() -> None:
    """Core and receiver hold MISRA C:2012 as far as cppcheck can tell, but for the deviations in firmware/misra.txt."""
    cppcheck = shutil.which("cppcheck")
    if cppcheck is None:
        pytest.skip("cppcheck is missing: apt-get install cppcheck")
    files = [str(file) for name in ("core", "receiver") for file in sorted((FIRMWARE / name).glob("*.c"))]
    command = [cppcheck, "--addon=misra", "--platform=pic8-enhanced", "--std=c99", "--enable=style", "--quiet"]
    command += [
        "--suppress=missingIncludeSystem",
        f"--suppressions-list={FIRMWARE / 'misra.txt'}",
        "--error-exitcode=1",
    ]
    command += [f"--suppressions-list={FIRMWARE / 'misra.txt'}"]
    command += [f"-I{FIRMWARE / 'core'}", f"-I{FIRMWARE / 'receiver'}", "--template={file}:{line} {id} {message}"]
    done = subprocess.run([*command, *files], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_core_has_no_malloc_float_or_printf() -> None:
    banned = re.compile(r"\b(malloc|calloc|realloc|free|float|double|printf|sprintf|snprintf)\b")
    for file in sorted((FIRMWARE / "core").iterdir()):
        code = re.sub(r"/\*.*?\*/", "", file.read_text(), flags=re.DOTALL)
        assert not banned.search(code), f"{file.name}: {banned.search(code)}"
