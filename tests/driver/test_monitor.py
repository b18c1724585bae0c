import io
import os
import subprocess
import sys
from dataclasses import replace

import pytest
from rich.console import Console

from gsense_driver.monitor_state import Link, MonitorState, Rate, Verdict, own_task, since
from gsense_driver.monitor_view import line, view

TASKS = frozenset({"link", "clock", "mpu6050"})
LINK = Link("unit-7", 990, 8, 2, 1, 0, 0, 300.0, 1.7e9 + 0.25, 12.5, 61.0, lost_since=3)


def state():
    out = MonitorState(("mpu6050/imu/data_raw", "bno055/imu/mag"))
    for i in range(100):
        out.take_sample("mpu6050/imu/data_raw", f"rate {i}", 10.0 + i * 0.005)
    out.take_link(LINK, 10.4)
    out.temperatures["mpu6050"] = 35.2
    out.battery_v = 3.91
    out.verdicts = {"clock": Verdict(0, "steady"), "link": Verdict(1, "3 frames lost"), "mpu6050": Verdict(0, "fine")}
    return out


def test_a_rate_is_of_the_last_two_seconds():
    rate = Rate()
    for i in range(1000):
        rate.count(i * 0.01)
    assert rate.value(9.99) == pytest.approx(100.0)
    assert rate.value(10.99) == pytest.approx(100.0)
    assert rate.value(12.5) == 0.0


def test_the_line_says_what_matters():
    text = line(state(), 10.5)
    for words in ("300 frames/s", "lost 8 corrupt 2 (1.000 %)", "+12.50 ppm", "1700000000.250000 s", "3.91 V"):
        assert words in text
    for words in ("mpu6050 35.2 C", "mpu6050/imu/data_raw 200", "warning: 3 frames lost"):
        assert words in text
    assert "\n" not in text
    assert "no driver" in line(state(), 20.0)
    assert "no driver" in line(MonitorState(()), 0.0)


def test_the_view_shows_values_and_reasons():
    stream = io.StringIO()
    console = Console(file=stream, width=140)
    console.print(view(state(), 10.5, "gsense /"))
    text = stream.getvalue()
    for words in ("rate 99", "200.0", "none yet", "unit-7", "3 lost, 0 corrupt", "3.910 V", "35.2", "3 frames lost"):
        assert words in text
    console.print(view(MonitorState(()), 0.0, "gsense /"))
    assert "no driver" in stream.getvalue()


def test_what_came_since_the_last_report():
    counts = {"received": 1000, "lost": 9, "corrupt": 2}
    assert since(counts, LINK) == (1, 0)
    assert since(counts, None) == (0, 0)
    assert since(counts, replace(LINK, received=5000)) == (0, 0)


def test_diagnostics_of_other_namespaces_and_nodes_are_left_out():
    assert own_task("bridge: link", "/", TASKS) == "link"
    assert own_task("lab/bridge: link", "/lab", TASKS) == "link"
    assert own_task("lab/bridge: link", "/", TASKS) is None
    assert own_task("a/lab/bridge: link", "/lab", TASKS) is None
    assert own_task("rig: rig", "/", TASKS) is None
    assert own_task("nonsense", "/", TASKS) is None


def test_once_without_a_driver_says_so():
    pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")
    command = [
        sys.executable,
        "-m",
        "gsense_driver.monitor",
        "--once",
        "--wait",
        "0.5",
        "--ros-args",
        "-r",
        "__ns:=/nobody",
    ]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.startswith("no driver reports")
    assert done.stdout.count("\n") == 1
