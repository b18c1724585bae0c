"""Noise that comes in bursts in motion, by what it does to the power of the cycles of the drive."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.verdict.bursts import bursts
from gsense_fusion.identification.verdict.residual import WindowResidual

N, RATE_HZ = 4400, 200.0
SPEEDS = (1.0, 3.1, 5.0, 6.5, 8.0)
"""rad/s."""


def _window(rng: np.random.Generator, w: float | None, course: np.ndarray | float) -> WindowResidual:
    """White noise of unit density times a course (n,)."""
    keep = np.fft.rfftfreq(N, 1 / RATE_HZ) <= 80.0
    keep[0] = False
    series = rng.standard_normal((N, 3)) * np.broadcast_to(course, N)[:, None]
    found = np.fft.rfft(series, axis=0)[keep] * np.sqrt(2.0 / N)
    motion = None if w is None else SimpleNamespace(angular_frequency=w)
    data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=RATE_HZ, name="run"), motion=motion)
    frequency = np.fft.rfftfreq(N, 1 / RATE_HZ)[keep]
    bins: Any = SimpleNamespace(keep=keep, frequency=frequency, weight=np.ones((len(frequency), 3)))
    window = Window(0, N, moving=w is not None)
    return WindowResidual(data, window, bins, np.stack([found.real, found.imag]))


def _course(rng: np.random.Generator) -> np.ndarray:
    """A second and a half somewhere in the run at half as much again."""
    course = np.ones(N)
    start = int(rng.integers(N - 300))
    course[start : start + 300] = 1.5
    return course


def _swell(w: float, rng: np.random.Generator) -> np.ndarray:
    """Up to twice as much where the carriage is fast."""
    return 1.0 + np.abs(np.sin(w * np.arange(N) / RATE_HZ + rng.uniform(0, 6)))


@pytest.mark.parametrize("seed", range(3))
def test_bursts_are_seen(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (found,) = bursts([_window(rng, w, _course(rng)) for w in SPEEDS], [_window(rng, None, 1.0)] * 2, np.inf)
    assert found.p_value < 1e-5


@pytest.mark.parametrize("seed", range(3))
def test_what_comes_with_every_cycle_is_no_burst(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (found,) = bursts([_window(rng, w, _swell(w, rng)) for w in SPEEDS], [_window(rng, None, 1.0)] * 2, np.inf)
    assert found.p_value > 1e-3


def test_bursts_at_rest_too_are_noise() -> None:
    rng = np.random.default_rng(1)
    still = [_window(rng, None, _course(rng)) for _ in range(3)]
    (found,) = bursts([_window(rng, w, _course(rng)) for w in SPEEDS], still, np.inf)
    assert found.p_value > 1e-3


def test_steady_noise_passes_as_often_as_it_says() -> None:
    """Without the drive's orders neighbouring cycles are alike, which counts."""
    rng = np.random.default_rng(4)
    rest = [_window(rng, None, 1.0) for _ in range(12)]
    chances = [bursts([_window(rng, w, 1.0) for w in SPEEDS], rest, np.inf)[0].p_value for _ in range(60)]
    assert np.mean(np.array(chances) < 0.1) < 0.2
    assert np.mean(np.array(chances) < 0.5) > 0.1


def test_without_rest_nothing_is_said() -> None:
    rng = np.random.default_rng(2)
    assert bursts([_window(rng, w, 1.0) for w in SPEEDS], [], np.inf) == []
