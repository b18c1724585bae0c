"""High orders of the drive that a window of any length would let leak into the bins between them."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.verdict.steady_orders import without_high_orders

RATE_HZ, SAMPLES = 200.0, 7260
W = 8.0


def _sine(order: int) -> np.ndarray:
    return np.asarray(np.cos(order * W / RATE_HZ * np.arange(SAMPLES) + 0.7))


@pytest.mark.parametrize("order", [30, 60, 112])
def test_a_line_and_what_folds_of_it_goes_with_its_leakage(order: int) -> None:
    noise = np.random.default_rng(3).standard_normal(SAMPLES)
    series = np.stack([noise + 30.0 * _sine(order), noise + 60.0 * _sine(order), noise], axis=1)
    left = without_high_orders(series, W, RATE_HZ, 0.75)
    assert np.abs(left[:, 0] - left[:, 1]).max() < 1e-6
    at_the_order = left[:, 0] - left[:, 2]  # no more than what the noise has there
    assert np.sum(at_the_order**2) < 12.0


def test_what_is_fitted_and_what_lies_between_stays() -> None:
    between = np.cos(60.5 * W / RATE_HZ * np.arange(SAMPLES))
    series = np.stack([_sine(3), between], axis=1)
    left = without_high_orders(series, W, RATE_HZ, 0.75)
    assert np.sum((left - series) ** 2) < 1e-3 * np.sum(series**2)


def test_noise_without_lines_keeps_its_power() -> None:
    series = np.random.default_rng(4).standard_normal((SAMPLES, 3))
    left = without_high_orders(series, W, RATE_HZ, 0.75)
    assert np.sum((left - series) ** 2) < 0.005 * np.sum(series**2)


def test_a_line_among_lines_stands_out_of_the_noise_between_them() -> None:
    noise = np.random.default_rng(6).standard_normal(SAMPLES)
    lines = sum(_sine(order) for order in range(21, 60))
    left = without_high_orders((noise + lines)[:, None], W, RATE_HZ, 0.75)[:, 0]
    assert np.sum((left - noise) ** 2) < 0.05 * np.sum(noise**2)


def test_a_window_too_short_for_its_orders_is_left_as_it_is() -> None:
    series = np.random.default_rng(5).standard_normal((400, 3))
    assert without_high_orders(series, 0.5, RATE_HZ, 0.75) is series
