"""What runs say that were not fitted: an effect that they do not show is no claim."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.study.simulator import Disturbance

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.errors.metrics import Held
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.verdict.carried_over import shares

from .sessions import SETTINGS, analyse, made, names

RATE_HZ, SAMPLES = 100.0, 3000
DENSITY = 4e-8


def _fold(series: Sequence[np.ndarray]) -> Held:
    """One moving window, with the residuals of the models declared, first, second."""
    data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=RATE_HZ), windows=(Window(0, SAMPLES, moving=True),))
    predictor: Any = SimpleNamespace(without=lambda _data, left: left)
    models: Any = dict(zip(("declared", "first", "second"), series, strict=True))
    return Held((data,), (data,), models, predictor)


@pytest.mark.parametrize("there", [0.0, 0.4, 1.0])
def test_the_share_is_the_part_that_the_runs_show(there: float) -> None:
    noise = np.random.default_rng(8).standard_normal((SAMPLES, 3)) * np.sqrt(DENSITY * RATE_HZ / 2)
    claim = 3e-3 * np.sin(2 * np.pi * 1.3 / RATE_HZ * np.arange(SAMPLES))[:, None] * np.array([1.0, -0.5, 0.2])
    flat = {axis: NoiseModel(DENSITY, 0.0, 0.0, np.array([1.0]), np.ones(1)) for axis in range(3)}
    left = noise + there * claim
    found = shares(
        ("declared", "first", "second"), ("first", "second"), [_fold([left, left - claim, left - claim])], flat
    )
    assert set(found) == {"first"}  # the second adds nothing
    assert found["first"].value == pytest.approx(there, abs=4 * found["first"].stderr)
    assert 0.005 < found["first"].stderr < 0.05
    assert found["first"].refuted == (there < 0.5)


@pytest.mark.slow
def test_what_the_runs_held_out_do_not_show_is_unexplained() -> None:
    loose = made(Disturbance("rectification", 3e-5))
    tight = made()
    runs = [a if a[1] == "fit" else b for a, b in zip(loose.runs, tight.runs, strict=True)]
    assert names(analyse(loose, SETTINGS)) == ["g_squared"]
    result = analyse(replace(loose, runs=tuple(runs)), SETTINGS)
    assert names(result) == []
    assert result.unexplained is not None
    assert any("runs held out" in note for note in result.notes)
