"""A node that is called with what it does not know or cannot use says so in one line and ends."""

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


@pytest.mark.parametrize(
    ("package", "name", "wrong"),
    [
        ("gsense_driver", "bridge", ("--params-file", "/nowhere.yaml")),
        ("gsense_driver", "monitor", ("-r", "nonsense")),
        ("gsense_fusion", "fusion", ("-p", "sensor")),
        ("gsense_rig", "dashboard", ("-r", "nonsense")),
        ("gsense_rig", "record", ("--params-file", "/nowhere.yaml")),
        ("gsense_rig", "rig", ("-p", "hardware")),
    ],
)
def test_what_ros_cannot_use_is_one_line(package, name, wrong):
    command = [str(executable(package, name)), "--ros-args", *wrong]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"{name}: --ros-args: ")
    assert " ".join(wrong) in done.stderr


@pytest.mark.parametrize(
    ("package", "name", "parameter"),
    [
        ("gsense_driver", "bridge", "port:=7"),
        ("gsense_fusion", "watch", "compensation_file:=7"),
        ("gsense_rig", "dashboard", "port:=-4"),
        ("gsense_rig", "record", "out:=7"),
        ("gsense_rig", "rig", "hardware:=5"),
    ],
)
def test_a_parameter_of_another_type_or_out_of_its_range_is_one_line(package, name, parameter):
    command = [str(executable(package, name)), "--ros-args", "-p", parameter]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"{name}: ")
    assert parameter.partition(":")[0] in done.stderr


@pytest.mark.parametrize(
    ("package", "name", "wrong", "near"),
    [
        ("gsense_driver", "bridge", "prot", "port"),
        ("gsense_driver", "monitor", "use_simtime", "use_sim_time"),
        ("gsense_fusion", "fusion", "compensation", "compensation_file"),
        ("gsense_fusion", "watch", "sensors", "sensor"),
        ("gsense_rig", "dashboard", "folders", "folder"),
        ("gsense_rig", "record", "topic", "topics"),
        ("gsense_rig", "rig", "hardwear", "hardware"),
    ],
)
def test_a_mistyped_parameter_is_one_line_with_the_right_one(package, name, wrong, near):
    command = [str(executable(package, name)), "--ros-args", "-p", f"{wrong}:=x"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr == f"{name}: parameter {wrong} is unknown; the nearest one is {near}\n"


def test_a_campaign_has_no_parameters(tmp_path):
    out = tmp_path / "out"
    command = [str(executable("gsense_rig", "campaign")), "minimum", "--out", str(out), "--ros-args", "-p", "seed:=1"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("campaign: parameter seed is unknown; ")
    assert not out.exists()
