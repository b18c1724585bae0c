"""What folds from above half the sample rate beside an answer to the force's rate of change is allowed for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.effects.jerk_coupling import JerkCoupling
from gsense_fusion.identification.verdict.coherent import Extra
from gsense_fusion.identification.verdict.residual import WindowResidual, _may_fold

RATE_HZ = 200.0
FREQUENCY = np.arange(60.0, 62.0, 5e-4)
K = 3.0
WEIGHT = 2.0


def _window(model: frozenset[str]) -> tuple[Any, Any, WindowResidual]:
    """One run along the sensor's x axis whose gyro answers with K times the force's rate of change about x."""
    mounting = SimpleNamespace(along=np.array([1.0, 0.0, 0.0]))
    source = SimpleNamespace(of=lambda *_: SimpleNamespace(mounting=mounting, templates=Templates()))
    columns = SimpleNamespace(index=lambda _: np.arange(3))
    likelihood = SimpleNamespace(source=source, effects=(JerkCoupling(),), columns=columns)
    fit = SimpleNamespace(names=model, templates=Templates(), beta_in=lambda _: np.array([K, 0.0, 0.0]))
    data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=RATE_HZ), mounting_number=0, motion=None)
    bins: Any = SimpleNamespace(frequency=FREQUENCY, weight=np.full((len(FREQUENCY), 3), WEIGHT))
    window: Any = SimpleNamespace(moving=True)
    return likelihood, fit, WindowResidual(data, window, bins, np.zeros((2, len(FREQUENCY), 3)))


@pytest.mark.parametrize("part", [0.1, 0.5, 0.8])
def test_no_part_that_folds_leaves_more(part: float) -> None:
    rng = np.random.default_rng(8)
    direct, folded = (rng.standard_normal((2, len(FREQUENCY), 2)) @ [1.0, 1j]) * np.sqrt([[1.0 - part], [part]])
    felt = direct + folded
    rate = 2j * np.pi * K * WEIGHT * (FREQUENCY * direct + (RATE_HZ - FREQUENCY) * folded)
    left = rate - felt * (np.vdot(felt, rate) / np.vdot(felt, felt))
    likelihood, fit, window = _window(frozenset({"jerk_coupling"}))
    allowed = _may_fold(likelihood, fit, window, Extra(felt[:, None] * [1.0, 0.0, 0.0], np.zeros((len(felt), 3))))
    assert allowed is not None
    power = np.mean(np.abs(left) ** 2) / 2.0
    assert power < 1.05 * allowed[:, 0].mean()
    assert power / allowed[:, 0].mean() == pytest.approx(4.0 * part * (1.0 - part), abs=0.06)
    assert not allowed[:, 1:].any()


def test_without_such_an_answer_nothing_is_allowed_for() -> None:
    likelihood, fit, window = _window(frozenset({"g_sensitivity"}))
    felt = np.ones((len(FREQUENCY), 3), dtype=complex)
    assert _may_fold(likelihood, fit, window, Extra(felt, np.zeros_like(felt))) is None
