"""Effects that are no claim and may well be there: the report says so, and which run would tell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG

from gsense_fusion.bags.run import Run, ScalarSeries
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.verdict import vetoes

from .sessions import SETTINGS, changed, made, names


def _line(result: LoopResult, name: str) -> str | None:
    return next((line for line in result.undecided if line.startswith(f"{name} could not be decided")), None)


@pytest.mark.slow
@pytest.mark.parametrize(("chance", "left_open"), [(0.003, True), (0.1, False)])
def test_a_temperature_that_drift_hardly_ever_imitates_is_left_open(
    monkeypatch: pytest.MonkeyPatch, chance: float, left_open: bool
) -> None:
    monkeypatch.setattr(vetoes, "p_beside", lambda *_, **__: chance)
    result = analyse(made(Disturbance("temperature_bias", 0.05 * DEG)), SETTINGS)
    assert names(result) == []
    line = _line(result, "temperature_bias")
    assert (line is not None) == left_open
    assert line is None or "record temperature_soak" in line
    assert any(n.startswith("temperature_bias gains no more") for n in result.notes) == (not left_open)


def _powered(fall: float) -> LoopResult:
    """A session whose supply falls by so many volts in its course."""
    session = made()
    first, last = session.runs[0][0].imu.stamp_ns[0], session.runs[-1][0].imu.stamp_ns[-1]

    def change(run: Run, role: str) -> tuple[Run, str]:
        time_ns = np.arange(run.imu.stamp_ns[0], run.imu.stamp_ns[-1], 10**9)
        return replace(run, battery=ScalarSeries(time_ns, 4.0 - fall * (time_ns - first) / (last - first))), role

    return analyse(changed(session, change), SETTINGS)


@pytest.mark.slow
def test_a_supply_that_never_moved_is_asked_for() -> None:
    line = _line(_powered(0.0), "supply_voltage")
    assert line is not None
    assert "c_x, c_y, c_z" in line
    assert "record supply_toggled" in line


@pytest.mark.slow
def test_a_supply_that_moved_is_known_and_not_asked_for() -> None:
    assert _line(_powered(0.4), "supply_voltage") is None
