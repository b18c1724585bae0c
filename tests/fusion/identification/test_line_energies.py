"""Energy of sines at the drive's orders behind a narrow filter, in a window that drifts more than its model knows."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.likelihood.bins import whiten_alike, window_bins
from gsense_fusion.identification.verdict.residual import HALF_ORDERS, WindowResidual, line_energies

RATE_HZ, SAMPLES, W = 200.0, 5760, 6.0
WHITE = 1e-8
CORNER_HZ = 10.0
PART = 1e-4
"""What is left above the filter: rounding."""


def _psd(frequency_hz: np.ndarray) -> np.ndarray:
    return np.asarray(WHITE * (1.0 / (1.0 + (frequency_hz / CORNER_HZ) ** 4) + PART))


def _residual(drift: float, tone: float, seed: int) -> WindowResidual:
    """Noise as the model says, a walk of `drift` rad/s/sqrt(s), a tone at the drive's first order, rad/s."""
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft(rng.standard_normal(SAMPLES)) * np.sqrt(
        _psd(np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)) * RATE_HZ / 2
    )
    t = np.arange(SAMPLES) / RATE_HZ
    series = (
        np.fft.irfft(spectrum, SAMPLES)
        + drift * np.cumsum(rng.standard_normal(SAMPLES)) / np.sqrt(RATE_HZ)
        + tone * np.cos(W * t)
    )
    model: Any = SimpleNamespace(psd=_psd, usable=lambda f, _resolution: np.ones(len(f)))
    bins = window_bins(SAMPLES, RATE_HZ, dict.fromkeys(range(3), model), highest_hz=80.0)
    rows = whiten_alike(series[None], bins)[:, :, 0]
    rows = np.stack([x - q @ (q.T @ x) for x, q in zip(rows.T, bins.slow, strict=True)], axis=1)
    run = SimpleNamespace(rate_hz=RATE_HZ)
    data: Any = SimpleNamespace(run=run, motion=SimpleNamespace(angular_frequency=W))
    return WindowResidual(data, Window(0, SAMPLES, moving=True), bins, rows.reshape(2, -1, 3))


@pytest.mark.parametrize("seed", [0, 1])
def test_a_drift_is_no_energy_at_the_orders(seed: int) -> None:
    found = line_energies(_residual(5e-4, 0.0, seed), HALF_ORDERS[1:] * W / (2 * np.pi))
    assert np.mean([line.calibrated for line in found]) < 4.0  # two are expected


def test_a_tone_keeps_its_size() -> None:
    found = line_energies(_residual(2e-4, 2e-4, 0), np.array([1.0, 2.0]) * W / (2 * np.pi))
    assert np.sqrt(found[0].amplitude_squared) == pytest.approx(np.full(3, 2e-4), rel=0.1)
    assert (found[0].calibrated > 50.0).all()
    assert (found[1].calibrated < 12.0).all()
