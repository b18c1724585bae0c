"""A run that is there already separates nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from gsense_fusion.identification.outcome.findings import _separating_run


def _session(*along: tuple[float, float, float]) -> Any:
    effects = {
        "viscous_tilt": SimpleNamespace(separates={"g_sensitivity": "board_turned_180"}, separating_run=None),
        "g_sensitivity": SimpleNamespace(separates={}, separating_run="board_turned_180"),
        "friction_pickup": SimpleNamespace(separates={}, separating_run="motor_beside_board"),
    }
    runs = [SimpleNamespace(mounting=SimpleNamespace(along=np.array(a))) for a in along]
    return SimpleNamespace(selection=SimpleNamespace(effects=effects), campaign=SimpleNamespace(fit=runs))


def test_a_board_that_was_turned_need_not_be_turned_again() -> None:
    once, turned = _session((1.0, 0.0, 0.0)), _session((1.0, 0.0, 0.0), (-1.0, 0.02, 0.0))
    assert _separating_run(once, "viscous_tilt", ["g_sensitivity"]) == "board_turned_180"
    assert _separating_run(turned, "viscous_tilt", ["g_sensitivity"]) is None
    assert _separating_run(turned, "viscous_tilt", ["g_sensitivity", "friction_pickup"]) == "motor_beside_board"
    assert _separating_run(turned, "viscous_tilt", []) is None
