"""The whole live graph, whose nodes are killed, stopped for a while or ended one by one; what that cost is counted.

A supervisor as launch's `respawn` starts a dead node again; nothing else is done for it. The rig alone is homed anew.
"""

from __future__ import annotations

import os
import select
import signal
import time
import urllib.request
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from geometry_msgs.msg import PoseStamped, Vector3Stamped
from gsense_msgs.action import Sinusoid
from gsense_msgs.msg import LinkStatus, RigState
from rclpy.action import ActionClient
from sensor_msgs.msg import Imu, JointState
from std_srvs.srv import Trigger

from gsense_fusion.bags import load_run
from gsense_rig.hardware.sim_memory import SIZE, RailMemory
from gsense_rig.plant.state import SPEED

from .compensations import compensation
from .ears import Ears
from .processes import Graph, parameters

IMU, POSE = "/mpu6050/imu/data_raw", "/rig/pose"
STEADY = {
    "board": IMU,
    "bridge": IMU,
    "rig": POSE,
    "fusion": "/mpu6050/madgwick_gcomp/imu/data",
    "watch": "/mpu6050/residual",
}
"""What tells that a node is there: 200 Hz each."""
NODES = (*STEADY, "record", "dashboard", "monitor")
WAYS = (signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM)
PERIOD_NS = 5_000_000
PATIENCE = 120.0
SOME = 20_000
"""Bytes more in a bag: its recorder works."""


@dataclass
class Strike:
    """One node hit once."""

    victim: str
    way: signal.Signals
    back_s: float = 0.0
    """From the blow (of SIGSTOP: from its end) until the node does its work again, start included."""
    gone_s: float = 0.0
    """From the blow to its end."""
    lost: int = 0
    """Messages of its steady topic that are missing; of the recorder: of the sensor's, not in any bag."""
    motor_s: float | None = None
    """From the blow to a motor that is off and at rest; None where the rig was not hit."""
    code: int | None = None
    """Exit code on SIGTERM."""
    faults: list[str] = field(default_factory=list)


class Kills:
    """The graph with everything in it."""

    def __init__(self, folder: Path, nodes: Sequence[str] = NODES) -> None:
        self.folder = folder
        self.nodes = nodes
        self.graph = Graph(folder)
        self.bags: list[Path] = []
        self._enough = SOME
        self.kept: dict[str, int] = {}
        """Messages in all bags by topic, after `finish`."""
        self.unkept: dict[str, int] = {}
        """Messages that were heard while a bag was open, and are not in it."""
        (folder / "compensation.yaml").write_text(compensation("mpu6050"))
        self.ears = Ears(
            {IMU: Imu, POSE: PoseStamped, "/rig/joint_states": JointState, "/rig/state": RigState, "/link": LinkStatus}
            | {STEADY["fusion"]: Imu, STEADY["watch"]: Vector3Stamped}
        )
        self._home = self.ears.node.create_client(Trigger, "/rig/home")
        self._reset = self.ears.node.create_client(Trigger, "/rig/reset")
        self._sine = ActionClient(self.ears.node, Sinusoid, "/rig/sinusoid")

    def begin(self) -> None:
        """Start every node, home the rig, and wait until all do their work."""
        for name in sorted(self.nodes, key=lambda name: name != "rig"):  # the board asks for its bus
            self._start(name)
        for name in self.nodes:
            self._await(lambda name=name: self._works(name, 0), f"work of {name}")
        self.move()

    def close(self) -> None:
        self.graph.close()
        self.ears.close()

    def move(self) -> None:
        """Bring the rig into motion, from whatever state it is in."""
        if self._mode() == RigState.FAULT:
            self._call(self._reset)
        if self._mode() == RigState.UNHOMED:
            self._call(self._home)
        if self._mode() == RigState.RUNNING:
            return
        self._await(self._sine.server_is_ready, "action rig/sinusoid")
        sent = self._sine.send_goal_async(Sinusoid.Goal(amplitude=0.15, angular_frequency=8.0, cycles=100_000))
        self._await(sent.done, "answer to the goal")
        self._await(lambda: abs(self._speed()) > 0.5, "motion")

    def strike(self, victim: str, way: signal.Signals, hold: float) -> Strike:
        """Hit a node, wait until it works again; `hold`: s that SIGSTOP lasts."""
        made = Strike(victim, way)
        process, before = self.graph.processes[victim], time.time_ns()
        known = len(self.ears.heard[STEADY[victim]]) if victim in STEADY else 0
        begun = time.monotonic()
        if victim == "monitor":
            _line(process)  # what it said before
        process.send_signal(way)
        if way == signal.SIGSTOP:
            time.sleep(hold)
            self._enough = self._recorded() + SOME
            process.send_signal(signal.SIGCONT)
            begun, before = time.monotonic(), time.time_ns()
        else:
            made.code = process.wait(PATIENCE)
            made.gone_s = time.monotonic() - begun
            if victim == "rig":
                self._await(self._motor_is_off, "motor that is off")
                made.motor_s = time.monotonic() - begun
            before = time.time_ns()  # the last words of the old one do not count
            if way == signal.SIGTERM and made.code != 0:
                made.faults.append(f"exit code {made.code} on SIGTERM")
            self._enough = SOME
            self._start(victim)
        self._await(lambda: self._works(victim, before), f"work of {victim}")
        made.back_s = time.monotonic() - begun
        self.graph.check()
        self.move()
        if victim in STEADY:
            made.lost = self._holes(STEADY[victim], known)
        return made

    def finish(self) -> list[str]:
        """End the recorder and look into the bags; a line for what was lost and is not told."""
        self.graph.end("record", signal.SIGINT)
        faults = []
        for bag in self.bags:
            run = load_run(bag, "mpu6050")
            assert run.pose is not None
            for topic, stamps in ((IMU, run.imu.stamp_ns), (POSE, run.pose.stamp_ns)):
                heard = self.ears.stamps(topic)
                inside = heard[(heard >= stamps[0]) & (heard <= stamps[-1])]
                # a node that begins anew is found by each of its listeners in its own time
                unkept, holes = len(np.setdiff1d(inside, stamps)), _missing(stamps)
                self.kept[topic] = self.kept.get(topic, 0) + len(stamps)
                self.unkept[topic] = self.unkept.get(topic, 0) + unkept
                if (unkept > 2 or holes > 20) and not any(
                    topic in note and "are missing" in note for note in run.notes
                ):
                    faults.append(f"{bag.name}: {topic}: {max(unkept, holes)} messages are missing and no note says so")
        return faults

    # ---- nodes

    def _start(self, name: str) -> None:
        folder, file = self.folder, self.folder / "compensation.yaml"
        self.graph.processes.pop(name, None)
        if name == "board":
            self.line = self.graph.start_board(name, "--bus", str(folder / "bus"), "--no-bench")
        elif name == "rig":
            given = parameters(seed=5, bus=folder / "bus", memory=folder / "rail", autohome=False)
            self.graph.start(name, "gsense_rig", "rig", *given)
        elif name == "bridge":
            self.graph.start(name, "gsense_driver", "bridge", *parameters(port=folder / "board-tty", unit_id="unit-5"))
        elif name in ("fusion", "watch"):
            self.graph.start(name, "gsense_fusion", name, *parameters(sensor="mpu6050", compensation_file=file))
        elif name == "record":
            self.bags.append(folder / f"bag_{len(self.bags)}")
            self.graph.start(name, "gsense_rig", "record", *parameters(out=self.bags[-1]))
        elif name == "dashboard":
            process = self.graph.start(name, "gsense_rig", "dashboard", *parameters(port=0, folder=folder))
            self.address = _line(process).split()[1].partition("#")[0]
        else:
            self.graph.start(name, "gsense_driver", "monitor")

    def _works(self, name: str, since_ns: int) -> bool:
        """Whether a node did its work after that time."""
        if name in STEADY:
            heard = self.ears.heard[STEADY[name]]
            return bool(heard) and int(self.ears.stamps(STEADY[name], len(heard) - 1)[0]) > since_ns
        if name == "record":
            return self._recorded() > self._enough
        if name == "dashboard":
            with urllib.request.urlopen(self.address, timeout=10.0) as page:
                return page.status == 200
        return " Hz" in _line(self.graph.processes[name])

    def _recorded(self) -> int:
        """Bytes of the newest bag."""
        return sum(file.stat().st_size for file in self.bags[-1].glob("*.mcap"))

    # ---- the rig

    def _mode(self) -> int:
        begun = len(self.ears.heard["/rig/state"])
        self._await(lambda: len(self.ears.heard["/rig/state"]) > begun, "rig/state")
        return int(self.ears.messages("/rig/state", self.ears.heard["/rig/state"][-1:])[0].mode)

    def _speed(self) -> float:
        return float(self.ears.messages("/rig/joint_states", self.ears.heard["/rig/joint_states"][-1:])[0].velocity[0])

    def _motor_is_off(self) -> bool:
        rail = RailMemory(memoryview(bytearray((self.folder / "rail").read_bytes()[:SIZE])))
        return rail.output.disabled and rail.values[SPEED] == 0.0

    def _call(self, client: Any) -> None:
        self._await(client.service_is_ready, client.srv_name)
        answer = client.call_async(Trigger.Request())
        self._await(answer.done, f"answer of {client.srv_name}")
        assert answer.result().success, answer.result().message

    def _await(self, done: Callable[[], Any], what: str) -> None:
        self.ears.wait(done, PATIENCE, what)

    def _holes(self, topic: str, known: int) -> int:
        """Messages missing since shortly before the given one."""
        return _missing(self.ears.stamps(topic, max(0, known - 20)))


def _missing(stamp_ns: np.ndarray) -> int:
    return int(np.maximum(np.rint(np.diff(np.sort(stamp_ns)) / PERIOD_NS) - 1, 0).sum())


def _line(process: Any) -> str:
    ready, _, _ = select.select([process.stdout], [], [], PATIENCE)
    assert ready, "no line"
    return os.read(process.stdout.fileno(), 65536).decode(errors="replace")
