"""What compensation.yaml takes off for an effect with further terms: what its model has, as far as it can be causal."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.fusion.report_results import nothing_missing

from gsense_fusion.compensation import (
    FrictionPickup,
    GResonance,
    JerkCoupling,
    SpeedPickup,
    Term,
)
from gsense_fusion.identification.result import Finding
from gsense_fusion.identification.types import Owner, Parameter
from gsense_fusion.report.outputs import compensation

D = (1.0, 0.0, 0.0)


def _terms(effect: str, **values: float | tuple[float, float, float]) -> tuple[Term, ...]:
    parameters = {}
    for name, value in values.items():
        each = dict(zip("xyz", value, strict=True)) if isinstance(value, tuple) else {"": value}
        parameters |= {f"{name}_{x}".rstrip("_"): Parameter(v, 1e-9, "") for x, v in each.items()}
    finding = Finding(effect, Owner.SENSOR, ("x",), parameters, 1e-9, 1e-3, 1e-4, (), None)
    return compensation(replace(nothing_missing(), findings=(finding,), direction=D)).terms


def test_a_coupling_behind_a_mode_is_late() -> None:
    (plain,) = _terms("jerk_coupling", c=(1e-5, 0.0, 0.0))
    (late,) = _terms("jerk_coupling", c=(1e-5, 0.0, 0.0), mode=40.0, lag=4e-3)
    assert plain == JerkCoupling((1e-5, 0.0, 0.0), D)
    assert late == JerkCoupling((1e-5, 0.0, 0.0), D, lag_s=4e-3)


def test_the_drag_of_a_friction_pickup_follows_the_speed() -> None:
    assert _terms("friction_pickup", c=(1e-3, 0.0, -2e-3), drag=0.5) == (
        FrictionPickup((1e-3, 0.0, -2e-3)),
        SpeedPickup((5e-4, 0.0, -1e-3)),
    )


def test_the_inertia_of_a_friction_pickup_is_in_its_term() -> None:
    assert _terms("friction_pickup", c=(1e-3, 0.0, 0.0), inertia=2.0) == (FrictionPickup((1e-3, 0.0, 0.0), 2.0),)


@pytest.mark.parametrize("second", [False, True])
def test_each_mode_of_a_mount_sways_and_turns(second: bool) -> None:
    c, rate = (1e-4, 0.0, 0.0), (0.0, 1e-6, 0.0)
    first = {"c": c, "rate": rate, "f0": 9.0, "damping": 0.1}
    more = {"c2": rate, "rate2": c, "f2": 14.0, "damping2": 0.2} if second else {}
    terms = _terms("g_resonance", **first, **more)
    assert terms == (GResonance(c, D, 9.0, 0.1, rate), GResonance(rate, D, 14.0, 0.2, c))[: 1 + second]
