"""A bias that walks in motion by far more than at rest: its largest step is no jump, nor its slow part an effect."""

from __future__ import annotations

import pytest
from tests.study.cases import Case, with_disturbances
from tests.study.judge import analyse
from tests.study.simulator import simulate

from .sessions import finding, names


@pytest.mark.slow
@pytest.mark.parametrize("seed", [33_000_003, 33_000_004])
def test_a_strong_walk_is_named_alone(seed: int) -> None:
    session = with_disturbances(Case("single", ("creep",), 40_000.0, seed, 50.0))
    result = analyse(simulate(session))
    assert (names(result), result.verdict) == (["bias_drift"], "effects_found")
    q = finding(result, "bias_drift").parameters["q"]
    assert abs(q.value - session.disturbances[0].size) < 3 * q.stderr
