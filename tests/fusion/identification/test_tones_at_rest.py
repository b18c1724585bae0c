"""A tone that rest shows as well as motion is noise, however strong: too weak for a notch, or leaking far beyond it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse
from tests.study.simulator import Session
from tests.study.simulator.parameters import DEG

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.noise.spectrum import fit_noise, periodogram

from .sessions import BASE, SETTINGS, changed, made, names

MAINS_HZ = 12.513
RATE_HZ = 100.0
EPOCH_NS = 1_700_000_000_000_000_000


def _humming(amplitude: float, at_rest: bool) -> Session:
    plan = [replace(run, duration_s=40.0 if run.angular_frequency else 20.0) for run in BASE.plan]

    def hum(run: Run, role: str) -> tuple[Run, str]:
        still = run.pose is not None and float(np.ptp(run.pose.position)) < 0.01
        tone = np.sin(2 * np.pi * MAINS_HZ * 1e-9 * (run.imu.stamp_ns - EPOCH_NS))[:, None] * np.array([1.0, 0.5, -0.7])
        rate = run.imu.angular_rate + (0.0 if still and not at_rest else amplitude) * tone
        return replace(run, imu=replace(run.imu, angular_rate=rate)), role

    return changed(made(base=replace(BASE, plan=tuple(plan))), hum)


@pytest.mark.slow
@pytest.mark.parametrize("amplitude", [0.006 * DEG, 0.2 * DEG])
def test_a_tone_that_rest_shows_too_is_no_finding(amplitude: float) -> None:
    result = analyse(_humming(amplitude, at_rest=True), SETTINGS)
    assert names(result) == []
    assert result.unexplained is None


@pytest.mark.slow
def test_the_same_tone_in_motion_alone_is_one() -> None:
    assert names(analyse(_humming(0.01 * DEG, at_rest=False), SETTINGS)) == ["line_tone"]


def test_what_a_strong_tone_leaks_is_left_out_too() -> None:
    rng = np.random.default_rng(4)

    def window(seconds: float, tone: float) -> np.ndarray:
        t = np.arange(0, seconds, 1 / RATE_HZ)
        return 1e-4 * rng.standard_normal(len(t)) + 1e-3 * np.sin(2 * np.pi * tone * t)

    noise = fit_noise([window(60.0, MAINS_HZ) for _ in range(2)], RATE_HZ)
    seen = [periodogram(window(33.0, MAINS_HZ), RATE_HZ) for _ in range(8)]
    frequency = seen[0].frequency
    over = np.mean([g.power for g in seen], axis=0) / noise.psd(frequency)
    usable = noise.usable(frequency, float(frequency[0]))
    assert usable.mean() > 0.8
    near = usable & (np.abs(frequency - MAINS_HZ) < 6.0)
    assert np.mean(over[near]) < 1.3
    assert np.max(over[near]) < 4.0
    assert len(noise.tones) == 1


@pytest.mark.parametrize("at_rest", [True, False])
def test_a_tone_that_only_the_stops_around_motion_have_is_not_the_rests(at_rest: bool) -> None:
    """The motor hums on while the carriage waits for its run to begin."""
    rng = np.random.default_rng(5)

    def window(seconds: float, amplitude: float) -> np.ndarray:
        t = np.arange(0, seconds, 1 / RATE_HZ)
        return 1e-4 * rng.standard_normal(len(t)) + amplitude * np.sin(2 * np.pi * MAINS_HZ * t + rng.uniform(0, 6))

    long = [window(60.0, 1e-4 if at_rest else 0.0) for _ in range(2)]
    noise = fit_noise(long + [window(2.0, 1e-4) for _ in range(20)], RATE_HZ)
    assert [t.frequency_hz for t in noise.tones] == ([pytest.approx(MAINS_HZ, abs=0.02)] if at_rest else [])
