"""What was of one size only beside a claim that fell, falls with it."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from tests.study.cases import Case, with_disturbances
from tests.study.judge import analyse
from tests.study.simulator import simulate

from gsense_fusion.identification.verdict import unequal

LEANS_ON = {"belt_tilt": "rail_curvature", "speed_pickup": "belt_tilt", "g_squared": None, "g_resonance": None}


@pytest.fixture
def selection(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Each effect holds in every run only where the one that it leans on is in the model."""

    def holds_alone(_selection: object, fit: frozenset[str], names: list[str]) -> list[str]:
        return [n for n in names if LEANS_ON[n] is not None and LEANS_ON[n] not in fit]

    monkeypatch.setattr(unequal, "claimed_fit", lambda _selection, names: frozenset(names))
    monkeypatch.setattr(unequal, "unequal_among", holds_alone)
    monkeypatch.setattr(unequal, "sound", lambda _selection, fit, name: name != "g_resonance" or "g_cubed" in fit)
    return SimpleNamespace()


def test_companions_of_a_demoted_claim_fall_one_after_the_other(selection: Any) -> None:
    names = ["rail_curvature", "belt_tilt", "g_squared", "speed_pickup"]
    assert unequal.companions(selection, names, [], ["rail_curvature"]) == ["belt_tilt", "speed_pickup"]


def test_a_refinement_of_shape_that_stays_supports_them(selection: Any) -> None:
    assert unequal.companions(selection, ["speed_pickup"], ["belt_tilt"], ["rail_curvature"]) == []


def test_without_a_demoted_claim_nothing_is_tested_again(selection: Any) -> None:
    assert unequal.companions(selection, ["belt_tilt"], [], []) == []


def test_a_claim_whose_mode_runs_to_its_end_without_a_demoted_one_falls_too(selection: Any) -> None:
    assert unequal.companions(selection, ["g_resonance", "g_squared"], ["g_cubed"], ["rail_curvature"]) == []
    assert unequal.companions(selection, ["g_resonance", "g_squared"], [], ["rail_curvature"]) == ["g_resonance"]


@pytest.mark.slow
def test_beside_a_drag_of_the_air_no_mount_is_named() -> None:
    """With a bow, which is of another size in every run, a mode fits it; without one it would have to ring no more."""
    result = analyse(simulate(with_disturbances(Case("outside", ("air_drag",), 4000.0, 7346200, 25.0))))
    assert (result.verdict, result.findings) == ("unexplained", ())
