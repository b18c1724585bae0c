"""Two rigs of one network, in the namespaces /a and /b of one ROS domain: nothing of one reaches the other."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from gsense_fusion.bags import load_run
from gsense_fusion.bags.storage import open_storage

pytestmark = [pytest.mark.graph, pytest.mark.timeout(600)]

RIGS = ("a", "b")
PLAN = "runs:\n  - {shape: sine, amplitude: 0.1, angular_frequency: 6, duration: 3, role: fit}\n"
SHARED = {"/diagnostics", "/rosout", "/parameter_events"}


@dataclass
class TwoRigs:
    """What both left behind."""

    folder: Path
    topics: dict[str, str]
    services: list[str]
    status_names: set[str]
    moved: dict[str, float]
    """Width of the way of each carriage during the campaign of `a`, m."""
    campaign: subprocess.CompletedProcess[str]
    third: subprocess.CompletedProcess[str]


@pytest.fixture(scope="module")
def rigs(tmp_path_factory: pytest.TempPathFactory, domain: int) -> Iterator[TwoRigs]:
    assert os.environ["ROS_DOMAIN_ID"] == str(domain)
    pytest.importorskip("rclpy", reason="needs ROS 2: run by ./rig test")
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseStamped
    from gsense_msgs.msg import RigState
    from sensor_msgs.msg import Imu

    from .ears import Ears
    from .processes import Graph

    folder = tmp_path_factory.mktemp("two_rigs")
    graph = Graph(folder)
    heard = {f"/{rig}/mpu6050/madgwick/imu/data": Imu for rig in RIGS}
    heard |= {f"/{rig}/rig/pose": PoseStamped for rig in RIGS} | {
        "/diagnostics": DiagnosticArray,
        "/b/rig/state": RigState,
    }
    ears = Ears(heard)
    try:
        for rig in RIGS:
            _start(graph, folder, rig)
        ears.wait(lambda: all(ears.heard.values()), 120.0, "message of each rig", graph.check)
        homed = ears.heard["/b/rig/state"]
        ears.wait(
            lambda: ears.messages("/b/rig/state", homed[-1:])[0].mode == RigState.IDLE, 60.0, "homed /b", graph.check
        )
        before = {rig: len(ears.heard[f"/{rig}/rig/pose"]) for rig in RIGS}
        campaign = _campaign(folder)
        third = _third_rig(folder)
        poses = {rig: ears.messages(f"/{rig}/rig/pose", ears.heard[f"/{rig}/rig/pose"][before[rig] :]) for rig in RIGS}
        graph.check()
        assert graph.end("record_b") == 0
        yield TwoRigs(
            folder,
            {name: kinds[0] for name, kinds in ears.node.get_topic_names_and_types()},
            [name for name, _ in ears.node.get_service_names_and_types()],
            {status.name for message in ears.messages("/diagnostics") for status in message.status},
            {rig: float(np.ptp([m.pose.position.x for m in poses[rig]])) for rig in RIGS},
            campaign,
            third,
        )
    finally:
        graph.close()
        ears.close()


def _start(graph: Any, folder: Path, rig: str) -> None:
    from .processes import parameters

    place = ("-r", f"__ns:=/{rig}")
    bus = folder / f"bus_{rig}"
    seed = 1 + RIGS.index(rig)
    graph.start(f"rig_{rig}", "gsense_rig", "rig", *parameters(bus=bus, seed=seed, autohome=rig == "b"), *place)
    port = graph.start_board(f"board_{rig}", "--bus", str(bus), "--no-bench")
    graph.start(f"bridge_{rig}", "gsense_driver", "bridge", *parameters(port=port, unit_id=f"unit-{rig}"), *place)
    graph.start(f"fusion_{rig}", "gsense_fusion", "fusion", *parameters(sensor="mpu6050"), *place)
    if rig == "b":
        graph.start("record_b", "gsense_rig", "record", *parameters(out=folder / "bag_b"), *place)


def _campaign(folder: Path) -> subprocess.CompletedProcess[str]:
    from .processes import executable

    (folder / "plan.yaml").write_text(PLAN)
    command = [executable("gsense_rig", "campaign"), folder / "plan.yaml", "--out", folder / "campaign", "--yes"]
    words = [*map(str, command), "--max-loss", "0.5", "--ros-args", "-r", "__ns:=/a"]
    return subprocess.run(words, capture_output=True, text=True, timeout=300, check=False)


def _third_rig(folder: Path) -> subprocess.CompletedProcess[str]:
    """On the bus of `a`, as two launches without names of their own would be."""
    from .processes import executable, parameters

    command = [str(executable("gsense_rig", "rig")), *parameters(bus=folder / "bus_a"), "-r", "__ns:=/c"]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


def test_every_name_is_in_a_namespace(rigs: TwoRigs) -> None:
    outside = {name for name in rigs.topics if name.split("/")[1] not in RIGS}
    assert outside <= SHARED
    names = [{name.removeprefix(f"/{rig}/") for name in rigs.topics if name.startswith(f"/{rig}/")} for rig in RIGS]
    assert {"link", "rig/state", "mpu6050/madgwick/imu/data"} <= names[0] & names[1]
    for rig in RIGS:
        assert {f"/{rig}/rig/{name}" for name in ("home", "stop", "reset", "park")} <= set(rigs.services)


def test_diagnostics_tell_the_rigs_apart(rigs: TwoRigs) -> None:
    parts = [{name.partition("/")[2] for name in rigs.status_names if name.startswith(f"{rig}/")} for rig in RIGS]
    assert parts[0] == parts[1] != set()
    assert all(name.startswith(("a/", "b/")) for name in rigs.status_names)


def test_only_the_rig_of_the_campaign_moves(rigs: TwoRigs) -> None:
    assert rigs.campaign.returncode == 0, rigs.campaign.stderr
    assert rigs.moved["a"] > 0.15
    assert rigs.moved["b"] < 0.001


def test_bags_hold_one_rig(rigs: TwoRigs) -> None:
    (run,) = yaml.safe_load((rigs.folder / "campaign" / "index.yaml").read_text())["runs"]
    for rig, bag in (("a", rigs.folder / "campaign" / run["bag"]), ("b", rigs.folder / "bag_b")):
        with open_storage(bag) as storage:
            names = {topic.name for topic in storage.topics.values()}
        assert {name for name in names if name.split("/")[1] != rig} <= SHARED
        loaded = load_run(bag, "mpu6050")
        assert loaded.topic == f"/{rig}/mpu6050/imu/data_raw"
        assert loaded.unit_id == f"unit-{rig}"
        assert loaded.encoder is not None


def test_a_second_rig_on_one_bus_is_refused(rigs: TwoRigs) -> None:
    assert rigs.third.returncode == 2
    (line,) = [line for line in rigs.third.stderr.splitlines() if line.startswith("rig: ")]
    assert "another simulated rig" in line
    assert str(rigs.folder / "bus_a") in line
