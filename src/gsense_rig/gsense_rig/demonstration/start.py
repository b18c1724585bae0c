"""Starts the live graph. Imports nothing heavy: the first sample shall come soon."""

from __future__ import annotations

import os
import select
import time
from dataclasses import dataclass
from pathlib import Path

from gsense_rig.demonstration.domain import free_domain
from gsense_rig.demonstration.folder import DemoFolder
from gsense_rig.demonstration.hidden import HiddenEffect, draw
from gsense_rig.demonstration.processes import Child, DemoError, Processes, ros_arguments

SENSOR = "mpu6050"
FILTER = "madgwick"
_BOARD_PATIENCE = 30.0
"""s until the board must have said where its pseudo-terminal is."""


@dataclass(frozen=True)
class Setting:
    """Where the graph lives."""

    domain: int
    command_begun: float
    """time.monotonic() when the process that became this one began (`./rig demo`, set-up included)."""
    graph_begun: float
    """time.monotonic() just before the graph's first process was started."""


@dataclass
class Live:
    """The live graph's processes."""

    hidden: HiddenEffect
    unit_id: str
    rig: Child
    board: Child
    bridge: Child
    fusion: Child | None = None


def processes(folder: DemoFolder) -> tuple[Processes, Setting]:
    """An empty set of processes in a ROS domain of their own."""
    domain = free_domain()
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": str(domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "RCUTILS_COLORIZED_OUTPUT": "0",
        "PYTHONUNBUFFERED": "1",
    }
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"  # of the demo's own node
    now = time.monotonic()
    return Processes(folder.log, environment), Setting(domain, now - _age(), now)


def graph(running: Processes, seed: int) -> Live:
    """Starts rig, board and bridge at once; all that the first sample needs."""
    hidden = draw(seed)
    unit_id = f"demo-{seed}"
    parameters = {"hardware": "sim", "seed": str(seed), "effects": f"['{hidden.argument}']"}
    rig = running.start("gsense_rig", "rig", *ros_arguments(parameters))
    board = running.start("gsense_driver", "board", "--no-bench", pipe=True)
    bridge = running.start("gsense_driver", "bridge", *ros_arguments({"port": _first_line(board), "unit_id": unit_id}))
    return Live(hidden, unit_id, rig, board, bridge)


def start_fusion(running: Processes, compensation: Path | None = None) -> Child:
    """The fusion node without a compensation file, or with one."""
    parameters = {"sensor": SENSOR, "filter": FILTER}
    if compensation is not None:
        parameters["compensation_file"] = str(compensation.absolute())
    label = "fusion" if compensation is None else "fusion_gcomp"
    return running.start("gsense_fusion", "fusion", *ros_arguments(parameters), label=label)


def _first_line(board: Child) -> str:
    """The path of the board's pseudo-terminal."""
    stream = board.process.stdout
    assert stream is not None  # noqa: S101 - started with a pipe
    ready, _, _ = select.select([stream], [], [], _BOARD_PATIENCE)
    line = stream.readline().strip() if ready else ""
    if not line:
        raise DemoError(f"the board did not say where its pseudo-terminal is: {board.last_words()} ({board.log})")
    return line


def _age() -> float:
    """Seconds since this process began; `exec` keeps that time."""
    try:
        ticks = int(Path("/proc/self/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[19])
    except (OSError, ValueError, IndexError):
        return 0.0
    return max(0.0, time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK"))
