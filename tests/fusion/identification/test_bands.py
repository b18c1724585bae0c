"""Noise in motion against noise at rest: what rest does not know well proves nothing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import resample
from scipy.stats import norm

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.types import Role
from gsense_fusion.identification.verdict.bands import LouderBand, louder_band, unsteady
from gsense_fusion.identification.verdict.residual import WindowResidual

from .sessions import BASE, SETTINGS, analyse, changed, made, names

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


def test_leaks_where_there_is_hardly_any_noise_are_none_of_the_motion() -> None:
    assert _p(_found([0.01] * 4, [0.1] * 9, 1)) > 1e-3


@pytest.mark.slow
def test_samples_given_at_twice_their_rate_are_missing_nothing() -> None:
    """Interpolated by the transform of the whole run: no noise from 50 to 100 Hz."""

    def twice(run: Run, role: Role) -> tuple[Run, Role]:
        imu, n = run.imu, len(run.imu.stamp_ns)
        stamps = np.interp(np.arange(2 * n - 1) / 2, np.arange(n), imu.stamp_ns - imu.stamp_ns[0])
        rate, force = (_interpolated(x) for x in (imu.angular_rate, imu.specific_force))
        stamp_ns = imu.stamp_ns[0] + stamps.astype(np.int64)
        return replace(run, imu=replace(imu, angular_rate=rate, specific_force=force, stamp_ns=stamp_ns)), role

    base = replace(BASE, chain=replace(BASE.chain, rate_hz=100.0, filter_hz=40.0))
    result = analyse(changed(made(base=base), twice), SETTINGS)
    assert (result.unexplained, names(result)) == (None, [])


def _interpolated(series: np.ndarray) -> np.ndarray:
    """Series (n, 3) at 2 n - 1 instants, periodic but for a slope."""
    slope = np.linspace(0.0, 1.0, 2 * len(series))[:, None] * (series[-1] - series[0])
    whole = resample(series - slope[::2], 2 * len(series), axis=0) + slope
    return np.asarray(whole[:-1])


def test_steady_noise_has_hardly_any_variance_of_its_own() -> None:
    rng = np.random.default_rng(5)
    counts = np.full(6, 40.0)
    draws = [unsteady(rng.standard_exponential((6, 40)).mean(axis=1), counts) for _ in range(300)]
    assert np.mean(draws) < 0.015
    assert unsteady(np.array([3.0, 5.0]), counts[:2]) == pytest.approx((2 * 40 * 0.25**2 - 1) / 40)
