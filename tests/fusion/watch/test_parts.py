"""Each test of the watcher on made-up series: right where something is, silent where nothing is."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import kstest

from gsense_fusion.identification.effects.base import Drivers
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.watch.history import History
from gsense_fusion.watch.levels import Level, Levels
from gsense_fusion.watch.orders import order_energies
from gsense_fusion.watch.spectrum import spectrum_of
from gsense_fusion.watch.window import Samples, Steady, steady_part

RATE_HZ, SECONDS, W = 200.0, 24.0, 5.0
NOISE = 1e-3


def steady(seed: int, more: float = 0.0, order: int = 2) -> Steady:
    rng = np.random.default_rng(seed)
    t = np.arange(0, SECONDS, 1 / RATE_HZ)
    residual = NOISE * rng.standard_normal((len(t), 3))
    residual[:, 1] += more * np.sin(order * W * t + 0.3)
    return Steady(t, residual, W, Drivers(Kinematics.at_rest(0.0, len(t)), None, None, None, t), None)


def test_p_values_of_noise_are_uniform() -> None:
    p = np.concatenate([order_energies(steady(seed), W).p_value for seed in range(12)])
    assert kstest(p, "uniform").pvalue > 1e-3


def test_a_harmonic_is_found_at_its_order_and_with_its_size() -> None:
    found = order_energies(steady(1, 3e-4, order=3), W)
    assert found.order[int(np.argmin(found.p_value))] == 3
    assert found.p_value.min() < 1e-12
    amplitude = np.hypot(*found.coefficient[:, 2, 1])
    assert amplitude == pytest.approx(3e-4, abs=4 * np.sqrt(found.level[2, 1]))
    assert found.remainder.std() == pytest.approx(NOISE, rel=0.02)


def test_a_tone_is_found_and_an_order_of_the_drive_is_none() -> None:
    tone = order_energies(steady(2, 4e-4, order=11.3), W).remainder
    assert spectrum_of(tone, RATE_HZ, W / (2 * np.pi)).lines == pytest.approx([11.3 * W / (2 * np.pi)], abs=0.05)
    harmonic = order_energies(steady(2, 4e-4, order=11), W).remainder
    assert len(spectrum_of(harmonic, RATE_HZ, W / (2 * np.pi)).lines) == 0
    assert len(spectrum_of(harmonic, RATE_HZ, None).lines) == 1


def test_the_density_of_white_noise_is_right() -> None:
    seen = spectrum_of(steady(3).residual, RATE_HZ, None)
    assert seen.density == pytest.approx([2 * NOISE**2 / RATE_HZ] * 3, rel=0.2)
    assert len(seen.lines) == 0


def level_series(seed: int, slope: float, jump: float) -> list[float]:
    """Times of the steps found in 60 means of 6 s with a ramp and a jump after the 40th."""
    rng = np.random.default_rng(seed)
    levels, found = Levels(), []
    for i in range(60):
        mean = 2e-5 * rng.standard_normal(3) + slope * i + np.array([0.0, jump if i >= 40 else 0.0, 0.0])
        step = levels.add(Level(6.0 * i, mean), np.array([0.0, 0.0, 1.0]))
        found += [] if step is None else [step.time]
    return found


@pytest.mark.parametrize("seed", range(5))
def test_a_step_is_found_and_a_ramp_is_none(seed: int) -> None:
    assert level_series(seed, 1e-5, 0.0) == []
    assert level_series(seed, 1e-5, 4e-4) == [240.0]


UP = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("within", [0.0, 0.3, 0.7])
def test_a_step_after_few_means_does_not_hide_itself(seed: int, within: float) -> None:
    """Its own first means were once part of the scale that it was held against."""
    rng = np.random.default_rng(seed)
    levels = Levels()
    steps = []
    for i in range(30):
        share = 0.0 if i < 9 else within if i == 9 and within else 1.0
        mean = 3e-5 * rng.standard_normal(3) + share * np.array([1e-4, 2e-4, -7e-4])
        step = levels.add(Level(6.0 * i, mean), UP)
        steps += [] if step is None else [i]
    assert len(steps) == 1
    assert 11 <= steps[0] <= 12


def test_wandering_means_are_no_steps() -> None:
    """Fifteen hours: white noise, flicker's slower half, a random walk of 1e-4 deg/s/sqrt(s), a warm-up."""
    rng = np.random.default_rng(4)
    found = 0
    for _ in range(15):
        levels, wander, walk = Levels(), np.zeros(3), np.zeros(3)
        for i in range(600):
            wander = 0.9 * wander + 1e-5 * rng.standard_normal(3)
            walk = walk + np.radians(1e-4) * np.sqrt(6.0) * rng.standard_normal(3)
            warm = 3e-4 * np.exp(-6.0 * i / 140.0)
            found += levels.add(Level(6.0 * i, 3e-5 * rng.standard_normal(3) + wander + walk + warm), UP) is not None
    assert found == 0


def test_a_turned_board_begins_anew() -> None:
    levels = Levels()
    for i in range(20):
        up = np.array([0.0, 0.0, 1.0]) if i < 10 else np.array([1.0, 0.0, 0.0])
        assert levels.add(Level(6.0 * i, np.full(3, 0.0 if i < 10 else 1e-2)), up) is None


def test_ramps_are_not_tested_and_rest_is() -> None:
    t = np.arange(0, SECONDS, 1 / RATE_HZ)
    force = np.tile([0.0, 0.0, 9.81], (len(t), 1))
    still = Samples(t, np.zeros((len(t), 3)), force, t, np.zeros(len(t)))
    resting = steady_part(still)
    assert resting is not None
    assert not resting.moving
    ramp = Samples(t, np.zeros((len(t), 3)), force, t, 1e-3 * t**2)
    assert steady_part(ramp) is None


def test_the_history_keeps_its_span_and_its_order() -> None:
    history = History(2, span_s=1.0, rate_hz=10.0)
    for i in range(1000):
        history.add(0.1 * i, float(i))
    assert history.recent()[:, 1] == pytest.approx(np.arange(989, 1000))
    assert history.newest == pytest.approx(99.9)
