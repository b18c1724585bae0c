"""The noise's spectrum of known processes."""

from __future__ import annotations

import numpy as np
import pytest
from tests.study.simulator.markov import realise
from tests.study.simulator.parameters import DEG

from gsense_fusion.identification.noise.spectrum import fit_noise


def test_noise_spectrum_of_known_processes() -> None:
    rng = np.random.default_rng(8)
    rate, white, tau, sigma = 100.0, 0.005 * DEG, 2.0, 0.004 * DEG
    windows = []
    for _ in range(4):
        t = np.arange(0, 60, 1 / rate)
        windows.append(realise(t, (tau,), (sigma,), rng) + white * np.sqrt(rate / 2) * rng.standard_normal(len(t)))
    model = fit_noise(windows, rate)
    f = np.array([0.1, 0.3, 1.0, 3.0, 10.0, 30.0])
    true = white**2 + 4 * sigma**2 * tau / (1 + (2 * np.pi * f * tau) ** 2)
    assert model.psd(f) == pytest.approx(true, rel=0.3)
    assert model.psd(f[3:]) == pytest.approx(true[3:], rel=0.1)
    assert model.tones == ()


def test_a_tone_at_rest_is_noise() -> None:
    rng = np.random.default_rng(9)
    t = np.arange(0, 60, 0.01)
    windows = [1e-4 * rng.standard_normal(len(t)) + 1e-4 * np.sin(2 * np.pi * 12.5 * t) for _ in range(2)]
    model = fit_noise(windows, 100.0)
    assert any(abs(x.frequency_hz - 12.5) < 0.05 for x in model.tones)
    assert not model.usable(np.array([12.5]), 1 / 60)[0]
    assert model.usable(np.array([11.0]), 1 / 60)[0]


def test_a_flat_spectrum_from_short_rest_is_flat_within_what_it_says() -> None:
    """Two minutes at 25 Hz: bands of 40 ordinates alone are off by a sixth each."""
    rng = np.random.default_rng(8)
    rate, worst, pulls = 25.0, [], []
    f = np.linspace(4.0, 10.0, 60)
    for _ in range(20):
        model = fit_noise([1e-3 * rng.standard_normal(1450) for _ in range(2)], rate)
        error = np.log(model.psd(f) / (2 * 1e-6 / rate))
        worst.append(float(np.abs(error).max()))
        pulls.append(error[30] / np.sqrt(model.variance(f[30:31])[0]))
    assert np.median(worst) < 0.13
    assert 0.5 < np.std(pulls) < 1.6


def test_a_filter_s_slope_is_not_smoothed_away() -> None:
    rng = np.random.default_rng(9)
    rate, n = 100.0, 6000
    at = np.fft.rfftfreq(n, 1 / rate)
    gain = 1 / np.sqrt(1 + (at / 15.0) ** 8)
    windows = [np.fft.irfft(np.fft.rfft(rng.standard_normal(n)) * gain, n) for _ in range(2)]
    model = fit_noise(windows, rate)
    f = np.linspace(6.0, 35.0, 30)
    truth = 2 / rate / (1 + (f / 15.0) ** 8)
    assert np.abs(np.log(model.psd(f) / truth)).max() < 0.4
    assert np.sqrt(model.variance(f)).max() < 0.25


def test_beyond_the_end_of_the_noise_there_is_nothing_to_weigh_by() -> None:
    rng = np.random.default_rng(9)
    rate, n = 200.0, 6000
    ends = np.fft.rfftfreq(n, 1 / rate) < 50.0
    windows = [np.fft.irfft(np.fft.rfft(1e-3 * rng.standard_normal(n)) * ends, n) for _ in range(3)]
    model = fit_noise([w[:5200] for w in windows], rate)
    assert model.usable(np.arange(5.0, 48.0), 1 / 26).all()
    assert not model.usable(np.arange(57.0, 100.0), 1 / 26).any()


def test_without_low_frequencies_there_is_no_model() -> None:
    assert np.isnan(fit_noise([np.random.default_rng(2).standard_normal(8)], 100.0).white)
