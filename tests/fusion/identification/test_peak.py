"""Where a likelihood is highest between two bounds, and how many values it takes to find out."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gsense_fusion.identification.search.peak import highest, peak

WITHIN = 1e-3


def _counted(value, start: float, low: float, high: float) -> tuple[float, int]:
    taken: list[float] = []

    def at(x: float) -> float:
        assert low <= x <= high
        taken.append(x)
        return value(x)

    return peak(at, start, low, high, WITHIN), len(taken)


@pytest.mark.parametrize("start", [0.0, 0.02, 0.3, 0.55, 1.0])
def test_a_smooth_top_takes_a_few_values_wherever_the_start(start: float) -> None:
    found, taken = _counted(lambda x: -50.0 * math.cosh(x - 0.4), start, 0.0, 1.0)
    assert found == pytest.approx(0.4, abs=2 * WITHIN)
    assert taken <= 6


def test_what_bends_up_at_the_start_is_searched_between_the_bounds() -> None:
    found, _ = _counted(lambda x: math.exp(-0.5 * ((x - 0.7) / 0.05) ** 2), 0.5, 0.0, 1.0)
    assert found == pytest.approx(0.7, abs=3 * WITHIN)


def test_a_slope_ends_at_the_bound() -> None:
    found, _ = _counted(lambda x: 3.0 * x, 0.5, 0.0, 1.0)
    assert found == pytest.approx(1.0, abs=5 * WITHIN)


def test_of_several_tops_the_highest_is_found() -> None:
    def tops(x: float) -> float:
        return math.exp(-0.5 * ((x - 1.0) / 0.8) ** 2) + 2.0 * math.exp(-0.5 * ((x - 3.3) / 0.4) ** 2)

    assert highest(tops, np.linspace(-4.0, 4.0, 17), WITHIN) == pytest.approx(3.3, abs=0.01)
