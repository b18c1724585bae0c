"""How far a searched parameter reaches: parabolas, stretches that the data leaves open, ends of the range."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.effects.base import Templates, TemplateSpec
from gsense_fusion.identification.interval import middle, reach, template_stderr

SPEC = TemplateSpec("t0", "s", "t", (), 0.0, 2000.0, 1.0)


def _profile(loglik: Callable[[float], float], best: float) -> tuple[Any, Any]:
    def evaluate(names: frozenset[str], templates: Templates, _start: object = None) -> Any:
        return SimpleNamespace(names=names, templates=templates, loglik=loglik(templates.get("t")))

    return SimpleNamespace(evaluate=evaluate), evaluate(frozenset(), Templates().set("t", best))


@pytest.mark.parametrize("sigma", [0.01, 0.7, 40.0])
def test_a_parabola_has_its_own_width(sigma: float) -> None:
    likelihood, fit = _profile(lambda t: -0.5 * ((t - 700.0) / sigma) ** 2, 700.0)
    assert template_stderr(likelihood, fit, SPEC) == pytest.approx(sigma, rel=1e-6)
    assert middle(likelihood, fit, SPEC) == pytest.approx(700.0, abs=1e-6 * sigma)


def test_an_instant_between_two_runs() -> None:
    """Nothing was recorded from 645 to 815 s; the search happened to end beside the second run."""
    likelihood, fit = _profile(lambda t: -20.0 * max(645.0 - t, 0.0, t - 815.0) ** 2, 814.0)
    t0 = middle(likelihood, fit, SPEC)
    assert t0 == pytest.approx(730.0, abs=5.0)
    likelihood, fit = _profile(lambda t: -20.0 * max(645.0 - t, 0.0, t - 815.0) ** 2, t0)
    assert template_stderr(likelihood, fit, SPEC) == pytest.approx(85.0, abs=5.0)


def test_the_range_ends_what_the_data_leaves_open() -> None:
    likelihood, fit = _profile(lambda _t: 0.0, 1990.0)
    assert reach(likelihood, fit, SPEC, 1) == pytest.approx(10.0)
    assert np.isfinite(template_stderr(likelihood, fit, SPEC))
