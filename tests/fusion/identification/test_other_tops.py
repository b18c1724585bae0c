"""A mode far above the drive: where several frequencies are nearly as likely, the errors reach them all."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.effects.g_resonance import GResonance
from gsense_fusion.identification.effects.speed_pickup import SpeedPickup
from gsense_fusion.identification.effects.time_offset import TimeOffset
from gsense_fusion.identification.search.interval import searched
from gsense_fusion.identification.search.other_tops import carried, errors_with_tops, other_tops

NAMES = frozenset({"g_resonance"})
COEFFICIENT = {5.0: 1.0, 8.6: 4.0}
"""What c comes to at each of two tops."""


def _two_tops(drop: float, sigma: float = 0.1) -> tuple[Any, Any]:
    """Tops at 5.0 and 8.6 Hz, the second `drop` lower; the damping is known to 0.02 beside either."""

    def evaluate(names: frozenset[str], templates: Templates, _start: object = None, **_kept: int) -> Any:
        f0, damping = templates.get("resonance_hz"), templates.get("resonance_damping")
        heights = {5.0: 0.0, 8.6: -drop}
        tops = {f: h - 0.5 * ((f0 - f) / sigma / f) ** 2 for f, h in heights.items()}
        best = max(tops, key=lambda f: tops[f])
        loglik = tops[best] - 0.5 * ((damping - 0.08) / 0.02) ** 2
        beta = np.full(3, COEFFICIENT[best])
        return SimpleNamespace(names=names, templates=templates, loglik=loglik, beta=beta, rank=3)

    likelihood = SimpleNamespace(evaluate=evaluate, effects=(GResonance(), TimeOffset()), searched={}, tops={})
    best = Templates((("resonance_damping", 0.08), ("resonance_hz", 5.0)))
    return likelihood, evaluate(NAMES, best)


def test_errors_reach_another_top_that_is_nearly_as_likely() -> None:
    likelihood, fit = _two_tops(1.0)
    (f0, damping), added = errors_with_tops(likelihood, fit, GResonance())
    alone = searched(likelihood, fit, GResonance())
    assert 5.0 + 1.96 * f0 > 8.6
    assert damping == pytest.approx(alone[0][1], rel=0.1)
    assert np.sqrt(np.diag(added)) * 1.96 == pytest.approx(np.full(3, 4.0 - 1.0), rel=0.05)
    (top,) = other_tops(likelihood, fit, GResonance())
    assert top.templates.get("resonance_hz") == pytest.approx(8.6, rel=0.01)


def test_a_top_that_is_out_of_the_question_widens_nothing() -> None:
    likelihood, fit = _two_tops(3.0)
    assert other_tops(likelihood, fit, GResonance()) == []
    with_tops, alone = (f(likelihood, fit, GResonance()) for f in (errors_with_tops, searched))
    assert np.array_equal(with_tops[0], alone[0])
    assert np.array_equal(with_tops[1], alone[1])


def test_only_modes_have_other_tops() -> None:
    likelihood, fit = _two_tops(1.0)
    assert other_tops(likelihood, fit, TimeOffset()) == []


def test_what_a_delay_leaves_open_is_in_the_errors_of_what_takes_its_place() -> None:
    known_s, slope = 1e-4, 0.3

    def evaluate(names: frozenset[str], templates: Templates, _start: object = None, **_kept: int) -> Any:
        late = templates.get("gyro_delay_s") - 0.01
        beta, covariance = np.array([1.0 - slope * late, 2.0, 3.0]), np.zeros((3, 3))
        loglik = -0.5 * (late / known_s) ** 2
        return SimpleNamespace(
            names=names, templates=templates, loglik=loglik, beta=beta, covariance=covariance, rank=3
        )

    effects = (SpeedPickup(), TimeOffset())
    likelihood: Any = SimpleNamespace(evaluate=evaluate, effects=effects, searched={}, tops={})
    there = Templates().set("gyro_delay_s", 0.01)
    both = evaluate(frozenset({"speed_pickup", "time_offset"}), there)
    alone = evaluate(frozenset({"speed_pickup"}), there)
    assert np.sqrt(np.diag(carried(likelihood, both))) == pytest.approx([slope * known_s, 0.0, 0.0], rel=0.05)
    assert np.array_equal(carried(likelihood, alone), np.zeros((3, 3)))
