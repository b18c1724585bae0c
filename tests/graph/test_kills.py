"""Nodes of the live graph die and are started again: what comes back, what is lost, and whether the motor stops."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: run by ./rig test")
pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace: run by ./rig test")

from .kills import IMU, POSE, Kills

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain"), pytest.mark.timeout(600)]


def test_bridge_fusion_and_rig_are_killed_and_come_back(tmp_path: Path) -> None:
    kills = Kills(tmp_path, ("rig", "board", "bridge", "fusion", "record"))
    try:
        kills.begin()
        strikes = {name: kills.strike(name, signal.SIGKILL, 0.0) for name in ("bridge", "fusion", "rig")}
        faults = kills.finish()
    finally:
        kills.close()
    assert faults == []
    assert [s.faults for s in strikes.values()] == [[], [], []]
    assert strikes["bridge"].lost > 20  # a node takes longer than that to start: the count sees it
    assert strikes["rig"].motor_s is not None
    assert kills.kept[IMU] > 400
    assert kills.kept[POSE] > 400
