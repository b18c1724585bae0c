"""One sanitized and instrumented build of the firmware for all its tests."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests.firmware.build import FIRMWARE, build, build_folder, has_cmocka


@pytest.fixture(scope="session")
def firmware_build(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The build folder; with the C tests where cmocka is there."""
    temporary = tmp_path_factory.mktemp("firmware")
    with_tests = has_cmocka(temporary / "probe")
    folder = build_folder(f"firmware-{'tests' if with_tests else 'board'}", temporary)
    for data in folder.rglob("*.gcda"):
        data.unlink()
    return build(folder, f"-DGSENSE_FIRMWARE_TESTS={'ON' if with_tests else 'OFF'}")


@pytest.fixture(scope="session")
def pic_hex(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of board.hex (default profile), board_fast.hex, receiver.hex, and the map of each.

    The first run on a machine builds the compiler (3 minutes on two cores); skips where that cannot be.
    """
    folder = tmp_path_factory.mktemp("pic")
    command = [sys.executable, str(FIRMWARE / "pic" / "build.py"), "--out", str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    print(done.stdout)
    last = done.stdout.strip().splitlines()[-1]
    if last.startswith("SKIP"):
        pytest.skip(last)
    return folder
