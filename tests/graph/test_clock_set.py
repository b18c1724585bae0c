"""The host's clock is set by an hour while the carriage moves: stamps follow, motion and safety do not notice."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="needs ROS 2: run by ./rig test")
pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace: run by ./rig test")

from gsense_msgs.msg import RigState

from gsense_fusion.bags import load_run

from .kills import IMU, POSE, STEADY, Kills
from .set_clock import set_by

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain"), pytest.mark.timeout(600)]

ROOT = Path(__file__).resolve().parents[2]
HOUR_NS = 3600 * 10**9
MODULES = {
    "rig": "gsense_rig.rig_node",
    "bridge": "gsense_driver.bridge_node",
    "record": "gsense_rig.record",
    "watch": "gsense_fusion.watch_node",
}


def test_stamps_follow_and_nothing_else_happens(tmp_path: Path) -> None:
    clock = tmp_path / "clock"
    set_by(clock, 0)
    kills = Kills(tmp_path, ("rig", "board", "bridge", "watch", "record"))
    kills.graph.environment["PYTHONPATH"] = f"{ROOT}:{kills.graph.environment.get('PYTHONPATH', '')}"
    kills.graph.instead = {
        name: [sys.executable, "-m", "tests.graph.set_clock", str(clock), module] for name, module in MODULES.items()
    }
    topics = (IMU, POSE, STEADY["watch"])
    try:
        kills.begin()
        time.sleep(2.0)
        for offset in (HOUR_NS, 0):
            set_by(clock, offset)
            kills.ears.wait(lambda o=offset: all(_follows(kills, t, o) for t in topics), 60.0, "stamps that follow")
            time.sleep(1.0)
        states = kills.ears.messages("/rig/state", kills.ears.heard["/rig/state"][-200:])
        kills.graph.check()
        kills.graph.end("record")
    finally:
        kills.close()
    assert {state.mode for state in states} == {RigState.RUNNING}
    assert {state.fault for state in states} == {RigState.NONE}
    for topic in topics:
        jumps = np.diff(kills.ears.stamps(topic))
        large = jumps[np.abs(jumps) > HOUR_NS // 2]
        assert np.abs(np.abs(large) - HOUR_NS).max() < 30 * 10**9  # and what a busy machine loses meanwhile
        assert np.sign(large).tolist() == [1, -1]  # once each, and no stamp between
    assert "alarm" not in kills.graph.log("watch")
    assert any("clock was set" in note for note in load_run(kills.bags[0], "mpu6050").notes)


def _follows(kills: Kills, topic: str, offset_ns: int) -> bool:
    stamps = kills.ears.stamps(topic, len(kills.ears.heard[topic]) - 1)
    return abs(int(stamps[0]) - time.time_ns() - offset_ns) < 60 * 10**9
