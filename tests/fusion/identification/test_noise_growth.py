"""How the power of an octave grows with the square of the speed."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.effects.speed_noise import _growth


def test_growth_of_exponential_powers_is_found_on_each_axis() -> None:
    rng = np.random.default_rng(5)
    v2, count = np.geomspace(0.002, 0.8, 12)[:, None], np.full((12, 1), 400.0)
    true = np.array([3.0, 0.4, 0.0])
    mean = 1.0 + true * v2
    drawn = np.array([_growth(v2, mean * rng.gamma(count, size=(12, 3)), count) for _ in range(200)])
    error = np.sqrt(1.0 / np.sum((v2 / mean) ** 2 * count, axis=0))
    assert drawn[:, :2].mean(axis=0) == pytest.approx(true[:2], abs=4 * error[:2].max() / np.sqrt(200))
    assert drawn[:, :2].std(axis=0) == pytest.approx(error[:2], rel=0.25)
    assert np.all(drawn >= 0.0)


def test_without_bins_nothing_grows() -> None:
    assert _growth(np.ones((3, 1)), np.zeros((3, 3)), np.zeros((3, 1))) == pytest.approx(np.zeros(3))
