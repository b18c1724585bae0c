"""One live graph for all tests of this folder: at rest, through one sinusoid, recorded twice."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.domains import own_domain

from .compensations import compensation

AMPLITUDE, ANGULAR_FREQUENCY, CYCLES = 0.15, 6.0, 5
WINDOW = 6.0  # s
PLAYS = 5  # at most, on a machine that stalls; a fault of ours would spoil each of them


@dataclass
class Told:
    """What one live graph said; filled once."""

    ears: Any
    graph: Any
    window: tuple[int, int] = (0, 0)
    """ns: a stretch with everything running, motion included."""
    motion: Any = None
    feedback: list[Any] = field(default_factory=list)
    bags: dict[str, Path] = field(default_factory=dict)
    exit_codes: dict[str, int] = field(default_factory=dict)
    advertised: frozenset[str] = frozenset()
    at_end: dict[str, int] = field(default_factory=dict)

    def inside(self, topic: str) -> np.ndarray:
        """Stamps (ns) in the window, in order of arrival."""
        stamps = self.ears.stamps(topic)
        return stamps[(stamps >= self.window[0]) & (stamps < self.window[1])]

    def links(self) -> list[Any]:
        """The messages of `link` in the window."""
        stamps = self.ears.stamps("/link")
        inside = (stamps >= self.window[0]) & (stamps < self.window[1])
        return self.ears.messages("/link", [self.ears.heard["/link"][i] for i in np.flatnonzero(inside)])


def topics() -> dict[str, Any]:
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseStamped
    from gsense_msgs.msg import LinkStatus, RigState
    from sensor_msgs.msg import BatteryState, Imu, JointState, MagneticField, Temperature

    return {
        "/mpu6050/imu/data_raw": Imu,
        "/bno055/imu/data_raw": Imu,
        "/bno055/imu/mag": MagneticField,
        "/lisy300/imu/data_raw": Imu,
        "/mpu6050/temperature": Temperature,
        "/bno055/temperature": Temperature,
        "/battery": BatteryState,
        "/link": LinkStatus,
        "/diagnostics": DiagnosticArray,
        "/rig/pose": PoseStamped,
        "/rig/joint_states": JointState,
        "/rig/state": RigState,
        "/mpu6050/madgwick/imu/data": Imu,
        "/bno055/madgwick/imu/data": Imu,
        "/bno055/madgwick_gcomp/imu/data": Imu,
        # of the second graph, in a namespace
        "/other/bno055/imu/data": Imu,
        "/other/link": LinkStatus,
        "/other/mpu6050/imu/data_raw": Imu,
    }


@pytest.fixture(scope="session")
def told(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Told]:
    pytest.importorskip("rclpy", reason="needs ROS 2: run by ./rig test")
    pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace: run by ./rig test")
    with own_domain():
        yield from _live(tmp_path_factory.mktemp("graph"))


def _live(folder: Path) -> Iterator[Told]:
    from .ears import Ears
    from .processes import Graph

    graph = Graph(folder)
    ears = None
    try:
        _start(graph, folder)
        ears = Ears(topics())
        made = Told(ears, graph, bags={name: folder / name for name in ("bag_int", "bag_term")})
        _play(made)
        graph.close()  # the tests look at what was heard; a graph that goes on would slow down all the others
        yield made
    finally:
        graph.close()
        if ears is not None:
            ears.close()


def _start(graph: Any, folder: Path) -> None:
    from .processes import parameters

    bus = folder / "bus"
    file = folder / "compensation.yaml"
    file.write_text(compensation("bno055"))
    graph.start("rig", "gsense_rig", "rig", *parameters(seed=11, bus=bus, effects="['rail_curvature=0.003']"))
    port = graph.start_board("board", "--bus", str(bus), "--no-bench")
    graph.start("bridge", "gsense_driver", "bridge", *parameters(port=port, unit_id="unit-11"))
    graph.start("fusion_mpu", "gsense_fusion", "fusion", *parameters(sensor="mpu6050"), "-r", "__node:=fusion_mpu")
    compensated = parameters(sensor="bno055", compensation_file=file)
    graph.start("fusion_bno", "gsense_fusion", "fusion", *compensated, "-r", "__node:=fusion_bno")
    graph.start("bag_int", "gsense_rig", "record", *parameters(out=folder / "bag_int"), "-r", "__node:=bag_int")
    some = parameters(out=folder / "bag_term", topics="['mpu6050/imu/data_raw', 'rig/pose']")
    graph.start("bag_term", "gsense_rig", "record", *some, "-r", "__node:=bag_term")
    # A second board on a table with the chip's own fusion, in a namespace and without a rig.
    other = graph.start_board("other_board", "--bus", str(folder / "no-bus"), "--bno", "ndof")
    graph.start(
        "other_bridge", "gsense_driver", "bridge", *parameters(port=other, unit_id="other"), "-r", "__ns:=/other"
    )


def _play(told: Told) -> None:
    """Home, then everything for some seconds with a motion in it, then the ends of both recorders."""
    from gsense_msgs.action import Sinusoid
    from rclpy.action import ActionClient
    from std_srvs.srv import Trigger

    ears, graph = told.ears, told.graph
    node = ears.node
    home = node.create_client(Trigger, "/rig/home")
    drive = ActionClient(node, Sinusoid, "/rig/sinusoid")
    silent = [name for name in ears.types if name != "/other/bno055/imu/data"]
    ears.wait(lambda: all(ears.heard[name] for name in silent), 120.0, "message on every topic", graph.check)
    ears.wait(home.service_is_ready, 120.0, "service rig/home")
    homed = home.call_async(Trigger.Request())
    ears.wait(homed.done, 120.0, "end of homing", graph.check)
    assert homed.result().success, homed.result().message
    for label in ("bag_int", "bag_term"):
        ears.wait(lambda label=label: _records(node, label), 120.0, f"{label} that records", graph.check)
    for _ in range(PLAYS):
        _drive(told, drive)
        if _is_whole(told):
            break
    told.advertised = frozenset(name for name, _ in node.get_topic_names_and_types())
    told.exit_codes["bag_int"] = graph.end("bag_int", signal.SIGINT)
    told.exit_codes["bag_term"] = graph.end("bag_term", signal.SIGTERM)
    ears.wait(lambda: ears.heard["/other/bno055/imu/data"], 120.0, "fused orientation of the other board", graph.check)


def _drive(told: Told, drive: Any) -> None:
    """One window with one sinusoid in it."""
    from gsense_msgs.action import Sinusoid

    ears, graph = told.ears, told.graph
    told.feedback.clear()
    begun = _newest(ears)
    ears.wait(drive.server_is_ready, 120.0, "action rig/sinusoid")
    goal = Sinusoid.Goal(amplitude=AMPLITUDE, angular_frequency=ANGULAR_FREQUENCY, cycles=CYCLES)
    sent = drive.send_goal_async(goal, feedback_callback=lambda m: told.feedback.append(m.feedback))
    ears.wait(sent.done, 120.0, "answer to the goal")
    assert sent.result().accepted
    result = sent.result().get_result_async()
    ears.wait(result.done, 120.0, "end of the sinusoid", graph.check)
    told.motion = result.result().result
    told.window = (begun, begun + round(WINDOW * 1e9))
    ears.wait(lambda: _newest(ears) > told.window[1] + 1_200_000_000, 120.0, "end of the window", graph.check)


def _is_whole(told: Told) -> bool:
    """Whether the machine gave the simulation and the readers of this window their time."""
    steps = np.diff(told.inside("/mpu6050/imu/data_raw")) / 5e6
    links = told.links()
    return len(steps) > 0.98 * 200 * WINDOW and (np.rint(steps) == 1).mean() > 0.99 and links[0].lost == links[-1].lost


def _records(node: Any, label: str) -> bool:
    return all(
        any(info.node_name == label for info in node.get_subscriptions_info_by_topic(topic))
        for topic in ("/mpu6050/imu/data_raw", "/rig/pose")
    )


def _newest(ears: Any) -> int:
    from .ears import stamp_ns

    return stamp_ns(ears.heard["/mpu6050/imu/data_raw"][-1])
