"""Harmonics by powers of one phasor, against cosines and sines themselves."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.motion.harmonics import fit_harmonics
from gsense_fusion.identification.motion.phasors import Phasors, powers

RNG = np.random.default_rng(1)
TIMES = {"scattered": np.sort(RNG.uniform(-20.0, 20.0, 3000)), "steady": 1234.5 + np.arange(3001) / 200.0}
W = 2.3
ORDERS = [np.array([1]), np.array([1, 2, 3]), np.array([2, 7, 90])]


def test_powers_are_the_exponentials() -> None:
    time = TIMES["scattered"]
    assert powers(W * time, 160) == pytest.approx(np.exp(1j * np.outer(W * np.arange(161), time)), abs=1e-11)


@pytest.mark.parametrize("time", TIMES.values(), ids=TIMES.keys())
@pytest.mark.parametrize("orders", ORDERS, ids=str)
def test_sums_are_those_of_the_columns(orders: np.ndarray, time: np.ndarray) -> None:
    phase = np.outer(time, W * orders)
    cosine, sine, phasors = np.cos(phase), np.sin(phase), Phasors.of(W * time)
    X = np.column_stack([np.ones(len(time)), cosine, sine])
    assert phasors.normal_matrix(orders) == pytest.approx(X.T @ X, abs=1e-6)
    series = RNG.standard_normal((2, len(time)))
    assert phasors.sums(series, orders) == pytest.approx(series @ (cosine + 1j * sine), abs=1e-8)
    size = RNG.standard_normal((2, len(orders))) * (1.0 - 2.0j)
    assert phasors.oscillation(size, orders) == pytest.approx((size @ np.exp(1j * phase).T).real, abs=1e-8)


def test_a_row_of_unequal_steps_is_not_taken_for_a_steady_one() -> None:
    time = TIMES["steady"].copy()
    time[1500:] += 0.005
    found = Phasors.of(W * time).oscillation(np.ones((1, 1), dtype=complex), np.array([1]))
    assert found[0] == pytest.approx(np.cos(W * time), abs=1e-8)


def test_harmonics_and_their_derivatives_come_back() -> None:
    time = np.arange(0.0, 20.0, 0.005)
    position = 0.15 * np.sin(W * time + 0.3) + 0.002 * np.cos(3 * W * time) + 0.01
    fit = fit_harmonics(time, position, W * 1.001)
    assert fit.angular_frequency == pytest.approx(W, rel=1e-9)
    assert fit.orders.tolist() == [1.0, 3.0]
    kin = fit.at(time)
    assert kin.position == pytest.approx(position, abs=1e-9)
    assert fit.position_at(time) == pytest.approx(kin.position, abs=1e-15)
    third = 0.002 * np.cos(3 * W * time)
    assert kin.jerk == pytest.approx(
        -0.15 * W**3 * np.cos(W * time + 0.3) + 0.002 * (3 * W) ** 3 * np.sin(3 * W * time), abs=1e-6
    )
    assert fit.acceleration_at(time) == pytest.approx(
        -0.15 * W**2 * np.sin(W * time + 0.3) - (3 * W) ** 2 * third, abs=1e-7
    )
