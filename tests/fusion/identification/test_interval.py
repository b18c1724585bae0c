"""How far a searched parameter reaches: parabolas, stretches that the data leaves open, ends of the range, pairs."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.effects.base import Templates, TemplateSpec
from gsense_fusion.identification.effects.friction_pickup import DragPickup, FrictionPickup
from gsense_fusion.identification.effects.temperature_bias import TemperatureBias
from gsense_fusion.identification.likelihood.gram import Gram
from gsense_fusion.identification.likelihood.identified import solve
from gsense_fusion.identification.search.interval import instant, joint, reach, searched, template_stderr

INSTANT = TemplateSpec("t0", "s", "t", (), 0.0, 2000.0, 1.0, gaps=True)
SPEC = TemplateSpec("t0", "s", "t", (), 0.0, 2000.0, 1.0)


def _profile(loglik: Callable[[float], float], best: float) -> tuple[Any, Any]:
    def evaluate(names: frozenset[str], templates: Templates, _start: object = None, **_kept: int) -> Any:
        return SimpleNamespace(names=names, templates=templates, loglik=loglik(templates.get("t")), rank=0)

    return SimpleNamespace(evaluate=evaluate), evaluate(frozenset(), Templates().set("t", best))


@pytest.mark.parametrize("sigma", [0.01, 0.7, 40.0])
def test_a_parabola_has_its_own_width(sigma: float) -> None:
    likelihood, fit = _profile(lambda t: -0.5 * ((t - 700.0) / sigma) ** 2, 700.0)
    assert template_stderr(likelihood, fit, SPEC) == pytest.approx(sigma, rel=1e-6)
    mean, deviation = instant(likelihood, fit, INSTANT)
    assert (mean, deviation) == (
        pytest.approx(700.0, abs=max(0.2, 0.05 * sigma)),
        pytest.approx(sigma, rel=0.05, abs=0.1),
    )


def test_a_parabola_is_measured_in_three_values_a_side() -> None:
    looked: list[float] = []

    def profile(t: float) -> float:
        looked.append(t)
        return -0.5 * ((t - 700.0) / 0.7) ** 2

    template_stderr(*_profile(profile, 700.0), SPEC)
    assert len(looked) <= 1 + 2 * 3


def test_an_instant_between_two_runs() -> None:
    """Nothing was recorded from 645 to 815 s; half a second of the second run fits by a hair better."""

    def profile(t: float) -> float:
        return 3.0 * np.exp(-(((t - 815.4) / 0.2) ** 2)) - 20.0 * max(645.0 - t, 0.0, t - 816.0) ** 2

    for found in (815.4, 730.0):
        t0, stderr = instant(*_profile(profile, found), INSTANT)
        assert t0 == pytest.approx(730.0, abs=5.0)
        assert stderr == pytest.approx(170.0 / np.sqrt(12.0), rel=0.05)


def test_the_range_ends_what_the_data_leaves_open() -> None:
    likelihood, fit = _profile(lambda _t: 0.0, 1990.0)
    assert reach(likelihood, fit, SPEC, 1) == pytest.approx(10.0)
    assert np.isfinite(template_stderr(likelihood, fit, SPEC))


@pytest.mark.parametrize("correlation", [0.0, 0.6, -0.98])
def test_two_that_move_together_are_as_uncertain_as_both(correlation: float) -> None:
    second = TemplateSpec("d", "1", "d", (), 0.0, 1.0, 0.1)
    best, sigma = np.array([700.0, 0.3]), np.array([3.0, 0.002])
    covariance = np.array([[1.0, correlation], [correlation, 1.0]]) * np.outer(sigma, sigma)
    information = np.linalg.inv(covariance)

    def evaluate(names: frozenset[str], templates: Templates, _start: object = None, **_kept: int) -> Any:
        off = np.array([templates.get("t"), templates.get("d")]) - best
        return SimpleNamespace(names=names, templates=templates, loglik=-0.5 * off @ information @ off, rank=0)

    fit = evaluate(frozenset(), Templates((("d", 0.3), ("t", 700.0))))
    found = joint(SimpleNamespace(evaluate=evaluate), fit, [SPEC, second])  # type: ignore[arg-type]
    assert found == pytest.approx(covariance, rel=0.02, abs=0.02 * sigma.prod())


def test_a_pair_that_does_not_bend_downwards_stays_finite() -> None:
    """A ridge: only the sum is known."""
    second = TemplateSpec("d", "s", "d", (), 0.0, 2000.0, 1.0)

    def evaluate(names: frozenset[str], templates: Templates, _start: object = None, **_kept: int) -> Any:
        off = templates.get("t") + templates.get("d") - 1400.0
        return SimpleNamespace(names=names, templates=templates, loglik=-0.5 * off**2, rank=0)

    fit = evaluate(frozenset(), Templates((("d", 700.0), ("t", 700.0))))
    found = joint(SimpleNamespace(evaluate=evaluate), fit, [SPEC, second])  # type: ignore[arg-type]
    assert np.all(np.isfinite(found))
    assert np.all(np.sqrt(np.diag(found)) > 10.0)
    assert np.sqrt(np.ones(2) @ found @ np.ones(2)) < 2.0


def test_a_direction_is_kept_while_a_searched_parameter_moves() -> None:
    """Its information falls from just above what identifies it to just below: the fit must not jump."""
    index, plausible = np.arange(2), np.ones(2)
    fits = [solve(Gram(np.diag([1e4, x]), np.array([1e4, 5 * x]), 0.0, 9), index, plausible, kept=2) for x in (12, 10)]
    assert [fit.rank for fit in fits] == [2, 2]
    assert fits[0][0] == pytest.approx(fits[1][0])
    assert solve(Gram(np.diag([1e4, 10.0]), np.array([1e4, 50.0]), 0.0, 9), index, plausible)[2] == 1
    assert solve(Gram(np.diag([1e4, 0.9]), np.array([1e4, 4.5]), 0.0, 9), index, plausible, kept=2)[2] == 1


def test_a_shape_that_is_uncertain_makes_the_columns_coefficients_so() -> None:
    """More drag, less friction: what the drag leaves open is open of the friction too."""
    names = frozenset({"friction_pickup", "friction_pickup_drag"})
    best, sigma, slope = 0.8, 0.05, np.array([3e-6, 0.0, -1e-6])

    def evaluate(_names: object, templates: Templates, _start: object = None, **_kept: int) -> Any:
        off = templates.get("friction_drag") - best
        return SimpleNamespace(
            names=names, templates=templates, loglik=-0.5 * (off / sigma) ** 2, rank=3, beta=1e-5 - slope * off
        )

    likelihood: Any = SimpleNamespace(evaluate=evaluate, effects=(FrictionPickup(), DragPickup()), searched={})
    errors, added = searched(likelihood, evaluate(names, Templates().set("friction_drag", best)), FrictionPickup())
    assert errors == pytest.approx([sigma], rel=1e-3)
    assert np.sqrt(np.diag(added)) == pytest.approx(np.abs(slope) * sigma, rel=0.05)


@pytest.mark.parametrize(("best", "sigma"), [(10.0, 6.0), (0.0, 2.0)])
def test_a_lag_that_is_not_worth_its_price_is_not_known_to_be_none(best: float, sigma: float) -> None:
    """What the likelihood leaves open of it is in its error, and in that of the coefficients that go with it."""
    slope = np.array([1e-6, 0.0, -3e-6])

    def evaluate(names: frozenset[str], templates: Templates, _start: object = None, **_kept: int) -> Any:
        lag = templates.get("temperature_lag_s")
        loglik = -0.5 * ((lag - best) / sigma) ** 2
        return SimpleNamespace(names=names, templates=templates, loglik=loglik, rank=3, beta=1e-4 + slope * lag)

    likelihood: Any = SimpleNamespace(evaluate=evaluate, effects=(TemperatureBias(),), searched={})
    without_lag = evaluate(frozenset({"temperature_bias"}), Templates())
    errors, added = searched(likelihood, without_lag, TemperatureBias())
    drawn = np.random.default_rng(4).normal(best, sigma, 200_000)
    expected = np.sqrt(np.mean(drawn[drawn > 0.0] ** 2))
    assert errors == pytest.approx([expected], rel=0.05)
    assert np.sqrt(np.diag(added)) == pytest.approx(np.abs(slope) * expected, rel=0.05)
