"""Bins in which the drive cannot show: neither its orders nor those that sampling folds down."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.verdict.residual import WindowResidual

RATE_HZ, SAMPLES = 200.0, 7200


def _away(w: float) -> tuple[np.ndarray, np.ndarray]:
    frequency = np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ)[1:]
    data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=RATE_HZ), motion=SimpleNamespace(angular_frequency=w))
    bins: Any = SimpleNamespace(frequency=frequency)
    residual = WindowResidual(data, Window(0, SAMPLES, moving=True), bins, np.zeros((2, len(frequency), 3)))
    return frequency, residual.away_from_orders()


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
