"""One sanitized and instrumented build of the firmware for all its tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from tests.firmware.build import build, build_folder, has_cmocka


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
def pic_hex() -> Path:
    """Folder with board.hex, receiver.hex and their maps."""
    folder = os.environ.get("GSENSE_PIC_HEX")
    if folder is None:
        pytest.skip("no hex of the firmware: name its folder in GSENSE_PIC_HEX")
    return Path(folder)
