"""Noise that grows with the speed by too little to be seen in the mean of slow and fast runs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.verdict.growing_noise import growing_noise
from gsense_fusion.identification.verdict.residual import WindowResidual

SPEEDS = (0.0, 0.0, 0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6, 0.8)
"""Root mean square, m/s."""
N = 4000


def _windows(rng: np.random.Generator, level: np.ndarray) -> tuple[Any, list[WindowResidual]]:
    """Likelihood and windows at 200 Hz whose power is some times the noise at rest, `level` (w, 3)."""
    frequency = np.fft.rfftfreq(N, 0.005)[1:]
    bins: Any = SimpleNamespace(frequency=frequency, weight=np.ones((len(frequency), 3)))
    out = []
    for v, factor in zip(SPEEDS, level, strict=True):
        data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=200.0), motion=None, speed=v)
        white = rng.standard_normal((2, len(frequency), 3)) * np.sqrt(factor)
        out.append(WindowResidual(data, Window(0, N, moving=v > 0), bins, white))
    source = SimpleNamespace(
        of=lambda data, _templates: SimpleNamespace(kinematics=SimpleNamespace(velocity=np.full(N, data.speed)))
    )
    return SimpleNamespace(noise=dict.fromkeys(range(3)), source=source), out


def _p_value(rng: np.random.Generator, level: np.ndarray) -> float:
    found = growing_noise(*_windows(rng, level))
    return min((x.p_value for x in found), default=1.0)


@pytest.mark.parametrize("unsteady", [0.0, 0.02])
def test_steady_noise_grows_by_chance_alone(unsteady: float) -> None:
    rng = np.random.default_rng(41)
    p = [_p_value(rng, 1.0 + unsteady * rng.standard_normal((len(SPEEDS), 1)) * np.ones(3)) for _ in range(200)]
    assert np.mean(np.array(p) < 0.05) <= 0.08
    assert min(p) > 1e-4


def test_a_fifth_more_at_1_m_per_s_is_seen_and_its_size_told() -> None:
    rng = np.random.default_rng(42)
    level = 1.0 + np.square(SPEEDS)[:, None] * np.array([0.20, 0.21, 0.23])
    likelihood, windows = _windows(rng, level)
    (found,) = growing_noise(likelihood, windows)
    assert found.p_value < 1e-5
    used = (windows[0].frequency >= 5.0).sum()
    assert found.rate_rms**2 == pytest.approx(0.21 * 0.64 * 4.0 * used / N**2, rel=0.4)


def test_one_loud_run_is_no_growth() -> None:
    rng = np.random.default_rng(43)
    level = np.ones((len(SPEEDS), 3))
    level[-1] = 1.5
    assert growing_noise(*_windows(rng, level)) == []


def test_too_few_windows_tell_nothing() -> None:
    likelihood, windows = _windows(np.random.default_rng(44), np.ones((len(SPEEDS), 3)))
    assert growing_noise(likelihood, windows[:3]) == []
    assert growing_noise(likelihood, windows[:2] * 3) == []
