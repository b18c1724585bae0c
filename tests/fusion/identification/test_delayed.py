"""Series that are late by a time, against the series themselves at the times before."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.motion.delayed import LONGEST_S, Delayed
from gsense_fusion.identification.types import FloatArray

RATE_HZ = 97.3
TIME = 812.4 + np.arange(1500) / RATE_HZ


def series(time: FloatArray) -> FloatArray:
    return np.stack([np.sin(7.0 * time), np.cos(40.0 * time)])


@pytest.mark.parametrize("delay_s", [-LONGEST_S, -0.0503, -1e-6, 0.0, 1e-6, 1 / RATE_HZ, 0.0171, 0.15, LONGEST_S])
def test_a_delay_is_a_look_back(delay_s: float) -> None:
    delayed = Delayed.of(TIME, RATE_HZ, series, 500.0)
    assert delayed.by(delay_s) == pytest.approx(series(TIME - delay_s), abs=1e-5)


def test_there_are_as_many_knots_as_asked_for_and_no_fewer_than_samples() -> None:
    assert Delayed.of(TIME, RATE_HZ, series, 50.0).pieces.shape[1] == 1
    assert Delayed.of(TIME, RATE_HZ, series, RATE_HZ).pieces.shape[1] == 1
    assert Delayed.of(TIME, RATE_HZ, series, 500.0).pieces.shape[1] == 6
