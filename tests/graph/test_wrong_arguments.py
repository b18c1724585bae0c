"""A node that is called with what it does not know says so and ends, instead of running without it."""

import subprocess

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")

from tests.graph.processes import executable


@pytest.mark.parametrize(
    ("package", "name"),
    [
        ("gsense_driver", "bridge"),
        ("gsense_fusion", "fusion"),
        ("gsense_fusion", "watch"),
        ("gsense_rig", "dashboard"),
        ("gsense_rig", "rig"),
    ],
)
def test_an_unknown_argument_is_refused(package, name):
    command = [str(executable(package, name)), "--port", "8080", "--ros-args", "-p", "use_sim_time:=false"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr == f"{name}: unrecognized arguments: --port 8080; {name} --help lists what it takes\n"
