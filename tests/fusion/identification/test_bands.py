"""Noise in motion against noise at rest: what rest does not know well proves nothing."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import norm

from gsense_fusion.identification.verdict.bands import LouderBand, louder_band, unsteady
from gsense_fusion.identification.verdict.residual import WindowResidual

FREQUENCY = np.arange(0.1, 40.0, 0.03)
LOW = FREQUENCY < 1.6
NOISE = {axis: SimpleNamespace(variance_between=lambda *_: 0.0) for axis in range(3)}


def _window(rng: np.random.Generator, level: float, *, moving: bool, folded: float = 0.0) -> WindowResidual:
    """Noise of so many times the expected power under 1.6 Hz."""
    power = np.where(LOW, level, 1.0)[:, None] * np.ones(3)
    data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=100.0), mounting_number=0, motion=None)
    bins: Any = SimpleNamespace(frequency=FREQUENCY, weight=np.ones((len(FREQUENCY), 3)), noise=NOISE)
    length = SimpleNamespace(moving=moving, start=0, stop=3333)
    window: Any = type("Samples", (SimpleNamespace,), {"__len__": lambda _: 3333})(**vars(length))
    spectrum = np.sqrt(power) * rng.standard_normal((2, len(FREQUENCY), 3))
    return WindowResidual(data, window, bins, spectrum, np.full((len(FREQUENCY), 3), folded))


def _found(rest: list[float], motion: list[float], seed: int, folded: float = 0.0) -> LouderBand:
    rng = np.random.default_rng(seed)
    still = [_window(rng, level, moving=False) for level in rest]
    moving = [_window(rng, level, moving=True, folded=folded) for level in motion]
    found = louder_band(moving, still)
    assert found is not None
    return found


def _p(found: LouderBand) -> float:
    return float(found.looks * norm.sf(found.z))


@pytest.mark.parametrize("seed", range(4))
def test_motion_that_is_louder_than_steady_rest_is_seen(seed: int) -> None:
    found = _found([1.0] * 4, [2.0] * 9, seed)
    assert _p(found) < 1e-6
    assert found.high_hz <= 1.6


@pytest.mark.parametrize("seed", range(4))
def test_a_level_that_wanders_from_rest_to_rest_proves_nothing(seed: int) -> None:
    """Rest of one to five times the model's power does not tell that three and four times are too much."""
    assert _p(_found([1.0, 5.0, 1.2], [3.0, 4.0, 4.5, 8.0, 3.0, 4.0], seed)) > 1e-3


@pytest.mark.parametrize("seed", range(4))
def test_what_may_fold_is_no_noise_of_the_motion(seed: int) -> None:
    assert _p(_found([1.0] * 4, [1.5] * 9, seed, folded=0.5)) > 1e-3


def test_steady_noise_has_hardly_any_variance_of_its_own() -> None:
    rng = np.random.default_rng(5)
    counts = np.full(6, 40.0)
    draws = [unsteady(rng.standard_exponential((6, 40)).mean(axis=1), counts) for _ in range(300)]
    assert np.mean(draws) < 0.015
    assert unsteady(np.array([3.0, 5.0]), counts[:2]) == pytest.approx((2 * 40 * 0.25**2 - 1) / 40)
