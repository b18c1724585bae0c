import subprocess
import sys

import pytest

from gsense_driver.user_input.arguments import ArgumentParser, without_ros


def test_a_wrong_argument_is_one_line(capsys):
    parser = ArgumentParser("tool")
    parser.add_argument("--rate", type=float)
    with pytest.raises(SystemExit) as ended:
        parser.parse_args(["--rate", "quick"])
    assert ended.value.code == 2
    told = capsys.readouterr().err
    assert told == "tool: argument --rate: invalid float value: 'quick'; tool --help lists what it takes\n"


def test_what_is_for_ros_is_left_out():
    pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")
    argv = ["/lib/tool", "a", "--ros-args", "-r", "__ns:=/x", "-p", "b:=1", "--", "--own", "c"]
    assert without_ros("tool", argv) == ["a", "--own", "c"]


def test_a_command_without_ros_loads_none_of_it():
    words = (
        "import sys; from gsense_driver.user_input.arguments import ArgumentParser; sys.exit('rclpy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", words], check=False).returncode == 0
