"""Which process runs which tests of the whole suite: computing side by side, then alone what waits for real time."""

from __future__ import annotations

import os

import pytest
from xdist.scheduler.loadscope import LoadScopeScheduling
from xdist.workermanage import WorkerController

MOST = 4  # processes: each holds simulated sessions of its own, some hundred MB
REAL_TIME = (
    "tests/docs/test_tutorial.py",
    "tests/driver/test_board",
    "tests/driver/test_bridge_",
    "tests/firmware/test_faults.py",
    "tests/firmware/test_host_board.py",
    "tests/fusion/test_fusion_node.py",
    "tests/fusion/watch/test_watch_node.py",
    "tests/graph/",
    "tests/rig/test_guard.py",
    "tests/rig/test_loop_process.py",
    "tests/rig/test_mf624.py",
    "tests/rig/test_record.py",
    "tests/rig/test_rig_kill.py",
    "tests/rig/test_rig_node.py",
    "tests/rig/test_sensors_bus.py",
    "tests/tools/test_rig.py",
)
"""Nodes, boards, loops and recorders: what another process computes beside them would hold them up."""
LONG = ("tests/firmware/", "tests/fusion/identification/", "tests/fusion/")
"""These first, so that the processes end together."""
_ALONE = "alone"
_FIRMWARE = "tests/firmware/"
"""They build in one folder, whose coverage they count."""


def processes(config: pytest.Config) -> int:
    """How many `-n auto` means: one a core for the whole suite; none but pytest's own where tests are named."""
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    cores = len(os.sched_getaffinity(0))
    return min(cores, MOST) if whole and cores > 1 else 0


def order(item: pytest.Item) -> tuple[bool, int]:
    """Sorts tests as `Turns` hands them out; within a file they stay as they are."""
    return item.nodeid.startswith(REAL_TIME), next(
        (i for i, p in enumerate(LONG) if item.nodeid.startswith(p)), len(LONG)
    )


class Turns(LoadScopeScheduling):
    """A file's tests (and all of the firmware) in one process, as they share what they made; REAL_TIME in the last."""

    def __init__(self, config: pytest.Config, log: object) -> None:
        config.option.loadscopereorder = False  # by `order` instead
        super().__init__(config, log)

    def _split_scope(self, nodeid: str) -> str:
        if nodeid.startswith(REAL_TIME):
            return _ALONE
        return _FIRMWARE if nodeid.startswith(_FIRMWARE) else nodeid.split("::", 1)[0]

    def _assign_work_unit(self, node: WorkerController) -> None:
        if next(iter(self.workqueue)) != _ALONE or len(self.nodes) == 1:
            super()._assign_work_unit(node)
        elif node is not self.nodes[0]:
            node.shutdown()

    def remove_node(self, node: WorkerController) -> str | None:
        crashed = super().remove_node(node)
        for left in self.nodes if self.workqueue else ():
            self._reschedule(left)
        return crashed
