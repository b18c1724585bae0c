"""How far a searched parameter reaches: parabolas, stretches that the data leaves open, ends of the range."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.effects.base import Templates, TemplateSpec
from gsense_fusion.identification.interval import instant, reach, template_stderr

INSTANT = TemplateSpec("t0", "s", "t", (), 0.0, 2000.0, 1.0, gaps=True)
SPEC = TemplateSpec("t0", "s", "t", (), 0.0, 2000.0, 1.0)


def _profile(loglik: Callable[[float], float], best: float) -> tuple[Any, Any]:
    def evaluate(names: frozenset[str], templates: Templates, _start: object = None) -> Any:
        return SimpleNamespace(names=names, templates=templates, loglik=loglik(templates.get("t")))

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
