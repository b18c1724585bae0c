"""The demo as users start it and end it: what it refuses, and that it never leaves a process behind.

Its whole story takes a minute: `./rig bench ten_demos` tells it with ten seeds.
"""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml

from .processes import executable

pytestmark = [pytest.mark.graph, pytest.mark.timeout(600)]


@contextmanager
def demo(*arguments: str) -> Iterator[subprocess.Popen[str]]:
    try:
        path = executable("gsense_rig", "demo")
    except FileNotFoundError as error:
        pytest.skip(str(error))
    started = subprocess.Popen([str(path), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        yield started
    finally:
        started.kill()
        started.communicate()


def descendants(pid: int) -> set[int]:
    """Processes below one, from /proc."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
            except (OSError, IndexError):
                continue
    found, grown = {pid}, True
    while grown:
        more = {child for child, parent in parents.items() if parent in found} - found
        found, grown = found | more, bool(more)
    return found - {pid}


def alive(pids: set[int]) -> dict[int, str]:
    """Those that still run, with their command lines; who is dead and not yet fetched counts as gone."""
    left = {}
    for pid in pids:
        try:
            state = (Path("/proc") / str(pid) / "stat").read_text().rsplit(")", 1)[1].split()[0]
            command = (Path("/proc") / str(pid) / "cmdline").read_text().replace("\0", " ")
        except OSError:
            continue
        if state not in "ZX":
            left[pid] = command
    return left


def wait_for_sample(started: subprocess.Popen[str]) -> None:
    assert started.stderr is not None
    for line in started.stderr:
        if "first sample" in line:
            return
    pytest.fail("the demo ended before its first sample")


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -9)])
def test_leaves_no_process_behind(tmp_path, number, code):
    with demo("--out", str(tmp_path / "out"), "--seed", "3") as started:
        wait_for_sample(started)
        below = descendants(started.pid)
        assert len(below) >= 5  # rig and its loop, board, bridge, fusion
        started.send_signal(number)
        _, errors = started.communicate(timeout=120)
        assert started.returncode == code, errors
        end = time.monotonic() + 60.0
        while alive(below) and time.monotonic() < end:
            time.sleep(0.1)
        assert alive(below) == {}
    assert "Traceback" not in errors
    assert yaml.safe_load((tmp_path / "out" / "demo.yaml").read_text())["state"] == "begun"
    assert not (tmp_path / "out" / "hidden.yaml").exists()


def test_a_process_that_dies_is_named_with_its_last_words(tmp_path):
    with demo("--out", str(tmp_path / "out"), "--seed", "3") as started:
        wait_for_sample(started)
        [board] = [pid for pid, command in alive(descendants(started.pid)).items() if "gsense_board" in command]
        os.kill(board, signal.SIGKILL)
        _, errors = started.communicate(timeout=120)
    assert started.returncode == 1
    assert errors.strip().splitlines()[-1].startswith("demo: board ended by SIGKILL: gsense_board: ")
    assert "board.log" in errors


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--seconds", "0"], "'0' is not a number of seconds from 2 to 600"),
        (["--seed", "x"], "'x' is not a whole number"),
        (["--out", "FULL"], "is not empty and no demo wrote it"),
        (["--out", "FULL/file"], "is a file; give a folder"),
    ],
)
def test_refuses_in_one_line(tmp_path, arguments, words):
    (tmp_path / "file").write_text("mine")
    with demo(*(argument.replace("FULL", str(tmp_path)) for argument in arguments)) as started:
        _, errors = started.communicate(timeout=120)
    assert started.returncode == 2
    assert words in errors.splitlines()[-1]
    assert [path.name for path in tmp_path.iterdir()] == ["file"]
