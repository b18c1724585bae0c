"""The graph that `campaign --yes` starts where none is running: simulated rig, host board and bridge."""

from __future__ import annotations

import os
import select
from pathlib import Path

from gsense_rig.campaign.crew import CampaignError
from gsense_rig.demonstration.processes import Child, DemoError, Processes, ros_arguments

UNIT = "simulated"
_BOARD_PATIENCE = 30.0


class SimulatedGraph:
    """Processes that end with `close`, or with this process. Raises CampaignError where one cannot be started."""

    def __init__(self, folder: Path, effects: tuple[str, ...] = (), seed: int = 1, namespace: str = "/") -> None:
        """`folder` takes the logs, the sensor bus and the pseudo-terminal's link; `namespace`: of the nodes."""
        folder.mkdir(parents=True, exist_ok=True)
        bus, link = folder / "bus", folder / "tty"
        self._processes = Processes(folder, {**os.environ, "PYTHONUNBUFFERED": "1"})
        place = ("-r", f"__ns:={namespace}")
        listed = ", ".join(f"'{effect}'" for effect in effects)
        parameters = {"hardware": "sim", "bus": str(bus), "seed": str(seed)}
        if effects:
            parameters["effects"] = f"[{listed}]"
        try:
            self._processes.start("gsense_rig", "rig", *ros_arguments(parameters), *place)
            board = self._processes.start(
                "gsense_driver", "board", "--bus", str(bus), "--no-bench", "--link", str(link), pipe=True
            )
            _wait_for(board)
            unit = {"port": str(link), "unit_id": f"{UNIT}-{seed}"}
            self._processes.start("gsense_driver", "bridge", *ros_arguments(unit), *place)
        except DemoError as error:
            self._processes.close()
            raise CampaignError(str(error)) from error

    def check(self) -> None:
        """Raises CampaignError where one has ended."""
        try:
            self._processes.check()
        except DemoError as error:
            raise CampaignError(str(error)) from error

    def close(self) -> None:
        """Ends all."""
        self._processes.close()


def _wait_for(board: Child) -> None:
    """The board's first line says that its pseudo-terminal is there."""
    stream = board.process.stdout
    if stream is None or not select.select([stream], [], [], _BOARD_PATIENCE)[0] or not stream.readline():
        raise DemoError(f"the board did not start: {board.last_words()} ({board.log})")
