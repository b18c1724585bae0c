"""A sensor that is none of ours, from its publisher to the report: live orientation, bag, closed loop, table."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytestmark = [pytest.mark.graph, pytest.mark.timeout(600)]

SENSOR, REFERENCE, K = "/vectornav/imu", "/ahrs/imu", 0.002
OUTPUT = f"{SENSOR}/madgwick/imu/data"
FOREIGN = Path(__file__).with_name("foreign_imu.py")


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory, domain: int) -> Iterator[tuple[Path, list[Any], str]]:
    """Folder with the bags of two runs, the orientations that were heard live, and the recorder's last words."""
    pytest.importorskip("rclpy", reason="needs ROS 2: run by ./rig test")
    assert os.environ["ROS_DOMAIN_ID"] == str(domain)
    from gsense_msgs.action import Sinusoid
    from gsense_msgs.msg import RigState
    from rclpy.action import ActionClient
    from sensor_msgs.msg import Imu

    from .ears import Ears
    from .processes import Graph, parameters

    folder = tmp_path_factory.mktemp("other_sensor")
    graph = Graph(folder)
    ears = Ears({OUTPUT: Imu, "/rig/state": RigState})
    stranger = subprocess.Popen([sys.executable, str(FOREIGN), str(K)])
    try:
        graph.start("rig", "gsense_rig", "rig", *parameters(bus=folder / "bus", autohome=True))
        graph.start("fusion", "gsense_fusion", "fusion", *parameters(sensor=SENSOR))
        ears.wait(lambda: ears.heard["/rig/state"], 120.0, "rig", graph.check)
        state = ears.heard["/rig/state"]
        ears.wait(lambda: ears.messages("/rig/state", state[-1:])[0].mode == RigState.IDLE, 60.0, "home", graph.check)
        drive = ActionClient(ears.node, Sinusoid, "/rig/sinusoid")
        for name, frequency in (("fit", 6.0), ("held_out", 5.0)):
            graph.start(name, "gsense_rig", "record", *parameters(out=folder / name), "-r", f"__node:={name}")
            ears.wait(lambda name=name: _recorded_by(ears.node, name), 60.0, "recorder", graph.check)
            _pause(ears, 6.0)
            ears.wait(drive.server_is_ready, 60.0, "action", graph.check)
            sent = drive.send_goal_async(Sinusoid.Goal(amplitude=0.15, angular_frequency=frequency, cycles=5))
            ears.wait(sent.done, 60.0, "answer", graph.check)
            ended = sent.result().get_result_async()
            ears.wait(ended.done, 120.0, "end of the motion", graph.check)
            _pause(ears, 2.0)
            assert graph.end(name) == 0
        yield folder, ears.messages(OUTPUT), graph.log("fusion")
    finally:
        stranger.kill()
        stranger.wait()
        graph.close()
        ears.close()


def _recorded_by(node: Any, name: str) -> bool:
    return all(
        any(info.node_name == name for info in node.get_subscriptions_info_by_topic(topic))
        for topic in (SENSOR, REFERENCE, "/rig/pose")
    )


def _pause(ears: Any, seconds: float) -> None:
    """Of the rig's time."""
    begun = len(ears.heard["/rig/state"])
    ears.wait(lambda: len(ears.heard["/rig/state"]) > begun + 50 * seconds, 60.0 + seconds, "state of the rig")


def test_best_effort_publisher_is_heard_live(recorded: tuple[Path, list[Any], str]) -> None:
    _, heard, log = recorded
    assert len(heard) > 500
    assert heard[-1].header.frame_id == "vectornav"
    tilt = [np.hypot(m.orientation.x, m.orientation.y) for m in heard[-50:]]
    assert max(tilt) < 0.02
    assert "best effort" in log


def test_the_loop_finds_its_g_sensitivity(recorded: tuple[Path, list[Any], str]) -> None:
    from gsense_fusion import close_loop

    folder, _, _ = recorded
    bags = ["--fit", str(folder / "fit"), "--held-out", str(folder / "held_out")]
    assert close_loop.main([*bags, "--sensor", SENSOR, "--out", str(folder / "report")]) == 0
    report = json.loads((folder / "report" / "report.json").read_text())
    found = report["declared_parameters"]["g_sensitivity"]["g_zx"]  # one mounting: what the rail's axis can show
    assert found["value"] == pytest.approx(K, abs=4 * found["stderr"])
    assert found["stderr"] < 0.02 * K
    assert report["rate_rms"]["declared"] < 0.5 * report["rate_rms"]["raw"]
    written = (folder / "report" / "compensation.yaml").read_text()
    assert f"sensor: {SENSOR}" in written
    assert "effect: g_sensitivity" in written


def test_another_ahrs_judges_the_filters(recorded: tuple[Path, list[Any], str]) -> None:
    from gsense_fusion import replay

    folder, _, _ = recorded
    words = [str(folder / "held_out"), "--sensor", SENSOR, "--reference", REFERENCE, "--filters", "vqf", "own"]
    assert replay.main([*words[:-1], "--no-bag", "--out", str(folder / "table")]) == 0
    found = json.loads((folder / "table" / "accuracy.json").read_text())["filters"]["vqf"]["raw"]
    assert found["inclination_rms"] < 1.0
