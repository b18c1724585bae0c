"""Each node ends well, also where a signal comes twice, as from launch or an impatient user."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest
from tests.graph.processes import Graph

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain")]

NODES = {
    "rig": ("gsense_rig", "rig", "rig on sim"),
    "bridge": ("gsense_driver", "bridge", "port open"),
    "fusion": ("gsense_fusion", "fusion", "mpu6050: madgwick"),
}


@pytest.mark.parametrize("label", NODES)
def test_a_second_signal_breaks_nothing(tmp_path: Path, label: str) -> None:
    graph = Graph(tmp_path)
    package, name, ready = NODES[label]
    board = [f"port:={graph.start_board('board')}"] if label == "bridge" else []
    process = graph.start(label, package, name, "--ros-args", *(word for value in board for word in ("-p", value)))
    try:
        _await(lambda: ready in graph.log(label))
        process.send_signal(signal.SIGINT)
        time.sleep(0.05)
        assert graph.end(label) == 0
        assert "Traceback" not in graph.log(label)
        assert "terminate called" not in graph.log(label)
    finally:
        graph.close()


def _await(done, seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end
        time.sleep(0.05)
