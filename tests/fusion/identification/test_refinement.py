"""What is small beside a large effect: a mend of its shape, or an effect of its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from tests.study.simulator import Disturbance

from gsense_fusion.identification.effects.friction_pickup import FrictionPickup
from gsense_fusion.identification.likelihood.gram import Columns
from gsense_fusion.identification.verdict.refinement import _elsewhere

from .sessions import BOW, analysed, names

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


@pytest.mark.slow
def test_a_delay_beside_a_bow_a_hundred_times_its_size_is_found() -> None:
    result = analysed(Disturbance(BOW.kind, 4 * BOW.size), Disturbance("time_offset", 0.012))
    assert names(result) == ["rail_curvature", "time_offset"], (result.unexplained, result.notes)
