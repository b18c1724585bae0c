"""A bias that wanders while the carriage moves, and a rest too short to tell that from the sensor's drift."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.study.simulator import Disturbance, SessionParameters
from tests.study.simulator.parameters import DEG

from .sessions import BASE, analysed, names

DATASHEET = 2e-4 * DEG
"""rad/s/sqrt(s): what an MPU-6050 may show."""


def _base(rest_s: float, motion_s: float = 26.0) -> SessionParameters:
    plan = [replace(run, duration_s=motion_s if run.angular_frequency else rest_s) for run in BASE.plan]
    return replace(BASE, plan=tuple(plan))


def _lines(*disturbances: Disturbance, rest_s: float = 45.0) -> list[str]:
    result = analysed(*disturbances, base=_base(rest_s))
    assert names(result) == []
    return [n for n in result.undecided if n.startswith("bias_drift")]


@pytest.mark.slow
@pytest.mark.parametrize(("times", "rest_s"), [(10.0, 12.0), (4.0, 45.0)])
def test_too_little_rest_leaves_a_drift_in_motion_undecided(times: float, rest_s: float) -> None:
    (line,) = _lines(Disturbance("creep", times * DATASHEET), rest_s=rest_s)
    assert "could not be decided" in line
    assert "record long_rest" in line


@pytest.mark.slow
def test_a_bias_that_does_not_wander_leaves_nothing_undecided() -> None:
    assert _lines() == []
