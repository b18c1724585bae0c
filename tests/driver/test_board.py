import os
import subprocess
import sys

from gsense_driver.board import find_board, own_arguments


def test_ros_arguments_are_dropped():
    given = ["--bus", "x", "--ros-args", "-r", "__node:=b", "--", "--link", "y", "--ros-args", "-p", "a:=1"]
    assert own_arguments(given) == ["--bus", "x", "--link", "y"]


def test_the_first_prefix_that_has_it_wins(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name / "lib/gsense_firmware").mkdir(parents=True)
    binary = tmp_path / "b/lib/gsense_firmware/gsense_board"
    binary.write_text('#!/bin/sh\necho "$@"\n')
    path = os.pathsep.join(["", str(tmp_path / "a"), str(tmp_path / "b")])
    assert find_board({"AMENT_PREFIX_PATH": path}) is None  # not executable
    binary.chmod(0o755)
    assert find_board({"AMENT_PREFIX_PATH": path}) == binary
    command = [sys.executable, "-m", "gsense_driver.board", "--seed", "3", "--ros-args", "-r", "x:=y"]
    env = {**os.environ, "AMENT_PREFIX_PATH": path, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "--seed 3")


def test_a_missing_board_is_one_line_and_exit_2(tmp_path):
    env = {**os.environ, "AMENT_PREFIX_PATH": str(tmp_path), "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        [sys.executable, "-m", "gsense_driver.board"], env=env, capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert len(done.stderr.strip().splitlines()) == 1
