"""The firmware's host board with faults: what the link counts is what the board knows to have happened."""

import json
import os
import subprocess
import time

import pytest
from tests.driver.board_process import read_all

from gsense_driver.board import find_board
from gsense_driver.port import SerialPort

FAULTS = {
    "each of them": "--lose 0.04 --repeat 0.04 --flip 0.04 --latency-bursts 16 --skew-ppm 50 --brownout 1.5",
    "across the wrap": "--lose 0.05 --start-us 4293467296 --latency-bursts 16 --skew-ppm -50",
}


@pytest.mark.parametrize("faults", FAULTS.values(), ids=FAULTS)
def test_the_link_counts_what_the_board_knows(faults, tmp_path):
    board = find_board(os.environ)
    if board is None:
        pytest.skip("the host board is not built: run the tests by ./rig test")
    truth_file = tmp_path / "truth.json"
    command = [board, "--bus", tmp_path / "none", "--truth", truth_file, "--duration", "2.5", *faults.split()]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    path = process.stdout.readline().strip()
    pipeline = read_all(SerialPort(path, 460800), lambda: process.poll() is None, time.monotonic_ns)
    counts = pipeline.link.counts
    counts.restarts -= pipeline.clock.steps  # supposed where a busy machine lets all frames come late for two seconds
    _, said = process.communicate(timeout=60)
    assert process.returncode == 0, said
    truth = json.loads(truth_file.read_text())
    assert (truth["unsent"], truth["unread"]) == (0, 0)
    known = {name: truth[name] for name in ("received", "lost", "corrupt", "duplicate", "restarts")}
    assert {name: getattr(counts, name) for name in known} == known
    assert counts.reordered == 0
    assert known["lost"] > 5
