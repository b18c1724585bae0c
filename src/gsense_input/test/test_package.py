"""What `colcon test` runs: the installed package by itself, then the repository's quick tests of it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_share_directory

PACKAGE, PART = "gsense_input", "input"
ROOT = Path(__file__).resolve().parents[3]
"""The repository, where this is its checkout."""


def test_what_it_ships_is_installed() -> None:
    share = Path(get_package_share_directory(PACKAGE))
    assert (share / "package.xml").exists()


def test_the_repositorys_own_tests_pass() -> None:
    if not (ROOT / "tests" / PART).is_dir():
        pytest.skip("a copy of the packages alone: the tests are in the repository's folder tests/")
    pytest.importorskip("pytest_timeout", reason="pytest-timeout is needed for the repository's tests")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST")}
    command = [sys.executable, "-m", "pytest", "-q", "-m", "not slow", f"tests/{PART}"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr[-2000:]
