"""A bias that changes through the session: what no effect of the catalogue names is seen all the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse

from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.effects.statistical import Explanation
from gsense_fusion.identification.likelihood.slow import Blocks
from gsense_fusion.identification.verdict import claims
from gsense_fusion.identification.verdict.courses import SETTLING_S, settling
from gsense_fusion.identification.verdict.sufficiency import Symptom

from .sessions import BASE, SETTINGS, TEMPERATURE, analysed, made, names


def test_settling_begins_anew_in_every_session() -> None:
    zero = np.zeros(12, dtype=np.int64)
    time = np.concatenate([np.arange(6) * 8.0, 900.0 + np.arange(6) * 8.0])
    columns = settling(Blocks(time, np.full(12, 8.0), np.zeros((12, 3)), np.repeat([0, 1], 6), zero, zero))
    assert columns.shape == (12, len(SETTLING_S))
    assert columns[:6] == pytest.approx(columns[6:])
    assert not columns[0].any()


@pytest.mark.slow
def test_a_warm_up_is_unexplained_where_the_catalogue_has_no_temperature() -> None:
    """Neither is it a step, which is what a warm-up's beginning looks like most."""
    without = replace(SETTINGS, catalogue=tuple(e for e in CATALOGUE if e.name != "temperature_bias"))
    result = analyse(made(TEMPERATURE), without)
    assert names(result) == []
    assert result.unexplained is not None
    assert "follows the die's temperature" in result.unexplained.description


@pytest.mark.slow
def test_a_warm_up_that_nothing_recorded_is_unexplained() -> None:
    result = analysed(TEMPERATURE, base=replace(BASE, temperature_topic=False))
    assert names(result) == []
    assert result.unexplained is not None
    assert "settles over some" in result.unexplained.description


@pytest.mark.slow
def test_a_bias_that_follows_something_is_no_drift_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    """A supply that sags in motion, where no temperature lets `supply_voltage` be decided."""
    course = Symptom("course", ("z",), 1e-9, 1e-4, (), "the bias follows the supply, most on z")
    drift = Explanation({}, ("z",), 1e-9, (), 0.0, settles="drift")
    monkeypatch.setattr(claims, "explain_noise", lambda *_: ([course], {"bias_drift": drift}))
    result = analyse(made(), SETTINGS)
    assert names(result) == []
    assert result.unexplained is not None
