"""How the power of an octave grows with the square of the speed, and how large the noise of a sample is."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.effects.speed_noise import _growth, _noise_rms
from gsense_fusion.identification.noise.spectrum import NoiseModel


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


@pytest.mark.parametrize("rate_hz", [25.0, 200.0])
def test_the_noise_of_a_sample_is_that_of_the_whole_band(rate_hz: float) -> None:
    """Above 0.4 of the rate nothing is looked at, and below 5 Hz the flicker is not what grows."""
    model = NoiseModel(4e-9, 4e-9, 0.0, np.array([0.1, 100.0]), np.ones(2))
    residual: Any = SimpleNamespace(
        bins=SimpleNamespace(noise={0: model}),
        window=range(1000),
        data=SimpleNamespace(run=SimpleNamespace(rate_hz=rate_hz)),
    )
    assert _noise_rms(residual, 0) == pytest.approx(np.sqrt(4e-9 * rate_hz / 2), rel=0.1)
    assert _noise_rms(residual, 1) == 0.0
