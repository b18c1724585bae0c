"""What is small beside a large effect: a mend of its shape, or an effect of its own."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import ChainParameters

from gsense_fusion.identification.effects.friction_pickup import FrictionPickup
from gsense_fusion.identification.effects.reversal_rock import ReversalRock
from gsense_fusion.identification.likelihood.gram import Columns
from gsense_fusion.identification.verdict import vetoes
from gsense_fusion.identification.verdict.refinement import _elsewhere
from gsense_fusion.identification.verdict.vetoes import refines

from .sessions import BASE, BOW, analysed, names

AT_200_HZ = replace(BASE, chain=ChainParameters(rate_hz=200.0, filter_hz=42.0))
EFFECTS = (FrictionPickup(),)
LIKELIHOOD = cast(
    "Any", SimpleNamespace(columns=Columns.of(EFFECTS), effects=EFFECTS, campaign=SimpleNamespace(fit=()))
)
ERROR = 1e-6
LARGE = np.array([[0.6], [0.0], [0.8]])


def _gain(coefficients: list[float]) -> float:
    fit = SimpleNamespace(beta=np.array(coefficients), covariance=np.eye(3) * ERROR**2)
    return _elsewhere(LIKELIHOOD, cast("Any", fit), "friction_pickup", LARGE)


def test_what_has_the_direction_of_the_large_effect_mends_its_shape() -> None:
    assert _gain([0.6e-4, 0.0, 0.8e-4]) == 0.0
    assert _gain([0.6e-4 + 2e-6, -2e-6, 0.8e-4]) == 0.0


def test_what_has_another_direction_is_its_own() -> None:
    assert _gain([0.6e-4, 1e-5, 0.8e-4]) == pytest.approx(100.0)
    assert _gain([0.8e-5, 0.0, -0.6e-5]) == pytest.approx(100.0)


def _turned(degrees: tuple[float, ...]) -> Any:
    """A play beside a large effect of the sensor, the board turned about the vertical from run to run."""
    rock = (ReversalRock(),)
    runs = []
    for number, angle in enumerate(np.deg2rad(degrees)):
        turn = np.array([[np.cos(angle), np.sin(angle), 0.0], [-np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        mounting = SimpleNamespace(sensor_from_rail=turn)
        windows = [SimpleNamespace(moving=True)]
        runs.append(SimpleNamespace(mounting_number=number, mounting=mounting, windows=windows))
    return SimpleNamespace(columns=Columns.of(rock), effects=rock, campaign=SimpleNamespace(fit=tuple(runs)))


@pytest.mark.parametrize(
    ("degrees", "coefficients", "own"),
    [
        ((0.0,), [0.6e-4, 0.0, 0.8e-4], False),
        ((0.0,), [0.2e-4, 0.0, 0.8e-4], True),
        ((0.0, 180.0), [0.2e-4, 0.0, 0.8e-4], False),  # in some runs one way round, in others the other
        ((0.0, 180.0), [0.6e-4, 1e-5, 0.8e-4], True),
        ((0.0, 90.0), [0.3e-4, 0.3e-4, 0.8e-4], False),
    ],
)
def test_a_turn_of_the_rig_mends_a_shape_of_the_sensors_in_each_mounting(
    degrees: tuple[float, ...], coefficients: list[float], own: bool
) -> None:
    fit = SimpleNamespace(beta=np.array(coefficients), covariance=np.eye(3) * ERROR**2)
    gain = _elsewhere(_turned(degrees), cast("Any", fit), "reversal_rock", LARGE)
    assert (gain > 0.0) == own


@pytest.mark.parametrize(
    ("shaped", "late", "claimed"), [(True, False, False), (True, True, True), (False, False, True)]
)
def test_a_delay_beside_a_shape_must_be_that_of_the_force(
    monkeypatch: pytest.MonkeyPatch, shaped: bool, late: bool, claimed: bool
) -> None:
    gains = {"reversal_rock": (3000.0, 4), "time_offset": (140.0, 1)}
    selection = SimpleNamespace(
        effects={n: SimpleNamespace(dynamic=True, family="fast" if n == "time_offset" else None) for n in gains},
        gain=lambda _, name: gains[name],
        shapes_of=lambda name: frozenset({"contact"} if shaped and name == "reversal_rock" else ()),
    )
    monkeypatch.setattr(vetoes, "delays_the_force", lambda *_: late)
    why = refines(cast("Any", selection), cast("Any", None), list(gains), "time_offset")
    assert (why is None) == claimed


@pytest.mark.slow
def test_a_delay_and_a_play_are_both_found() -> None:
    result = analysed(Disturbance("bearing_play", 4e-5), Disturbance("time_offset", 0.02), base=AT_200_HZ)
    assert names(result) == ["reversal_rock", "time_offset"], (result.unexplained, result.notes)


@pytest.mark.slow
def test_a_delay_beside_a_bow_a_hundred_times_its_size_is_found() -> None:
    result = analysed(Disturbance(BOW.kind, 4 * BOW.size), Disturbance("time_offset", 0.012))
    assert names(result) == ["rail_curvature", "time_offset"], (result.unexplained, result.notes)
