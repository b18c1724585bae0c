"""Bins in which the drive cannot show: neither its orders nor those that sampling folds down."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.verdict.residual import WindowResidual

RATE_HZ, SAMPLES = 200.0, 7200


def _residual(w: float) -> WindowResidual:
    frequency = np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)[1:]
    data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=RATE_HZ), motion=SimpleNamespace(angular_frequency=w))
    bins: Any = SimpleNamespace(frequency=frequency)
    return WindowResidual(data, Window(0, SAMPLES, moving=True), bins, np.zeros((2, len(frequency), 3)))


def _away(w: float) -> tuple[np.ndarray, np.ndarray]:
    residual = _residual(w)
    return residual.frequency, residual.away_from_orders()


@pytest.mark.parametrize("order", [12, 48, 99, 112])
def test_an_order_is_left_out_where_it_shows(order: int) -> None:
    """At 8 rad/s orders from the 79th on lie above half the sample rate."""
    frequency, away = _away(8.0)
    f = order * 8.0 / (2 * np.pi)
    shown = min(f, RATE_HZ - f)
    assert not away[np.argmin(np.abs(frequency - shown))]


@pytest.mark.parametrize("w", [1.0, 2.0, 5.0, 8.0])
def test_enough_is_left_to_test(w: float) -> None:
    frequency, away = _away(w)
    assert away[frequency > 20.0].mean() > 0.4


@pytest.mark.parametrize(("order", "stays"), [(30, False), (99, False), (125, False), (135, False), (5, True)])
def test_what_folds_above_the_band_of_the_fit_is_taken_out(order: int, stays: bool) -> None:
    """The 135th order of 8 rad/s is at 172 Hz and shows at 28 Hz: a kick's lines in the bins between the orders."""
    sine = np.cos(order * 8.0 / RATE_HZ * np.arange(SAMPLES) + 0.4)[:, None]
    left = _residual(8.0).between_orders(sine)
    assert np.std(left) == pytest.approx(np.std(sine) if stays else 0.0, abs=1e-3)


@pytest.mark.parametrize(("w", "gone"), [(4.0, True), (5.0, True), (10.0, True), (6.0, False), (8.0, False)])
def test_a_run_says_where_a_folded_order_took_a_tone_with_it(w: float, gone: bool) -> None:
    """At 31.3 Hz lie the 265th, the 212th and the 106th order of 4, 5 and 10 rad/s, folded; none of 6 or 8 rad/s."""
    tone = np.sin(2 * np.pi * 31.3 / RATE_HZ * np.arange(SAMPLES) + 0.4)[:, None]
    residual = _residual(w)
    assert residual.gone_with_an_order(31.3) == gone
    left = np.std(residual.between_orders(tone)) / np.std(tone)
    assert (left < 0.3) if gone else (left > 0.9)
