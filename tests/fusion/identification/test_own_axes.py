"""A sensor whose axes answer differently to shaking, in a session that brings two of them along the rail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.study.simulator import Disturbance, PlannedRun
from tests.study.simulator.disturbances import MECHANISMS, Scene

from gsense_fusion.identification.types import FloatArray

from .sessions import BASE, analysed, finding, names

SPEEDS = (5.0, 8.0, 2.6, 6.5, 3.5)
PLAN = tuple(
    run
    for deg in (0.0, 90.0)
    for run in (
        PlannedRun(0.0, 45.0, turned_deg=deg),
        *(PlannedRun(w, 16.0, turned_deg=deg) for w in SPEEDS),
        PlannedRun(5.7, 16.0, role="held_out", turned_deg=deg),
    )
)
TURNED = replace(BASE, plan=PLAN)
OWN = np.array([[0.8, -0.6, 0.1], [0.1, 0.9, 0.5], [-0.5, 0.2, 0.7]])
"""Column k: what the gyro's axes make of shaking along the sensor's axis k."""


def _squares(scene: Scene, size: float) -> FloatArray:
    """A rectifying element in each axis, saturating. Size in rad/s at 10 m/s^2."""
    shaken = np.outer(scene.travel.acceleration / 10.0, scene.along)
    return size * np.log1p(shaken**2) @ OWN.T


def _lag(scene: Scene, size: float) -> FloatArray:
    """A charge amplifier of 2 ms leaks what changes. Size in rad/s at 100 m/s^3."""
    shaken = np.outer(scene.travel.acceleration, scene.along)
    change = np.gradient(shaken, scene.travel.time, axis=0) / 100.0
    return size * change @ OWN.T


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mechanism", "size", "effect"), [(_squares, 3e-3, "g_squared"), (_lag, 1e-3, "jerk_coupling")]
)
def test_each_axis_along_the_rail_has_coefficients_of_its_own(
    monkeypatch: pytest.MonkeyPatch, mechanism: Callable[[Scene, float], FloatArray], size: float, effect: str
) -> None:
    kind = f"own_axes_{effect}"
    monkeypatch.setitem(MECHANISMS, kind, mechanism)
    result = analysed(Disturbance(kind, size), base=TURNED)
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == [effect]
    found = finding(result, effect).parameters
    first, more = (np.array([found[f"{c}_{x}"].value for x in "xyz"]) for c in ("c", "cy"))
    for k, own in enumerate((first, first + more)):
        assert own @ OWN[:, k] / np.linalg.norm(own) / np.linalg.norm(OWN[:, k]) > 0.98


@pytest.mark.slow
def test_axes_that_answer_alike_need_no_terms_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    def alike(scene: Scene, size: float) -> FloatArray:
        return np.outer(size * np.log1p((scene.travel.acceleration / 10.0) ** 2), scene.direction)

    monkeypatch.setitem(MECHANISMS, "alike", alike)
    result = analysed(Disturbance("alike", 3e-3), base=TURNED)
    assert names(result) == ["g_squared"]
    assert "cy_x" not in finding(result, "g_squared").parameters


@pytest.mark.slow
def test_nothing_is_found_in_two_mountings_where_nothing_is_hidden() -> None:
    assert analysed(base=TURNED).verdict == "nothing_missing"
