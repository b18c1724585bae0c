"""A warmth that motion leaves behind, and a mode that every reversal excites: both must be seen."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gsense_fusion.identification.likelihood.slow import Blocks
from gsense_fusion.identification.verdict.exertion import remembered
from gsense_fusion.identification.verdict.high_orders import locked_band

RATE = 200.0
SAMPLES = 6000


def test_what_is_remembered_charges_in_motion_and_decays_at_rest_and_between_runs() -> None:
    second = np.arange(40.0)
    on = np.stack([second, np.ones(40), np.zeros(40)], axis=1)
    off = np.stack([second + 100.0, np.zeros(40), np.zeros(40)], axis=1)
    middle = np.array([4.0, 36.0, 104.0, 136.0])
    none = np.zeros(4, dtype=np.int64)
    blocks = Blocks(middle, np.full(4, 8.0), np.zeros((4, 3)), none, none, none)
    full = 1.0 - np.exp(-40.0 / 20.0)
    expected = [1 - np.exp(-4 / 20), 1 - np.exp(-36 / 20), full * np.exp(-64 / 20), full * np.exp(-96 / 20)]
    assert remembered(blocks, [(0, on), (0, off)], 0, 20.0) == pytest.approx(expected, abs=0.04)
    assert remembered(blocks, [(0, on), (1, off)], 0, 20.0)[2:] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert not remembered(blocks, [(0, on), (0, off)], 1, 20.0).any()


def _window(rng: np.random.Generator, angular_frequency: float, kick: float, noise: float = 1.0) -> Any:
    """A white residual, with a mode of 14 Hz that is kicked twice a period."""
    frequency = np.fft.rfftfreq(SAMPLES, 1 / RATE)
    time = np.arange(SAMPLES) / RATE
    since = time % (np.pi / angular_frequency)
    signal = kick * np.exp(-since / 0.1) * np.sin(2 * np.pi * 14.0 * since)
    series = noise * rng.standard_normal((SAMPLES, 3)) + signal[:, None]
    power = np.abs(np.fft.rfft(series, axis=0)) ** 2 / SAMPLES
    order = frequency * 2 * np.pi / angular_frequency
    away = np.abs(order - np.rint(2 * order) / 2) > 2.5 * 2 * np.pi * RATE / SAMPLES / angular_frequency
    return SimpleNamespace(
        window=range(SAMPLES),
        frequency=frequency,
        power=power,
        resolution_hz=RATE / SAMPLES,
        angular_frequency=angular_frequency,
        away_from_orders=lambda: away,
        bins=SimpleNamespace(weight=np.ones((len(frequency), 3))),
    )


def test_a_mode_that_reversals_excite_stands_out_though_no_single_order_does() -> None:
    rng = np.random.default_rng(3)
    found = locked_band([_window(rng, w, 0.6) for w in (3.0, 4.0, 5.0, 6.5, 8.0)])
    assert found is not None
    assert found.p_value < 1e-8
    assert found.low_hz <= 14.0 <= found.high_hz


def test_noise_that_is_louder_in_motion_is_not_locked_to_the_drive() -> None:
    rng = np.random.default_rng(4)
    for _ in range(20):
        found = locked_band([_window(rng, w, 0.0, noise=1.5) for w in (3.0, 4.0, 5.0, 6.5, 8.0)])
        assert found is not None
        assert found.p_value > 1e-3


def test_slow_drives_have_no_orders_that_stand_apart() -> None:
    assert locked_band([_window(np.random.default_rng(5), 0.01, 0.0)]) is None
