"""Harmonics by powers of one phasor, against cosines and sines themselves."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.motion.harmonics import fit_harmonics
from gsense_fusion.identification.motion.phasors import normal_matrix, phasors

TIME = np.sort(np.random.default_rng(1).uniform(-20.0, 20.0, 3000))
W = 2.3


def test_powers_are_the_exponentials() -> None:
    orders = np.arange(1, 161)
    assert phasors(W * TIME, 160) == pytest.approx(np.exp(1j * np.outer(W * orders, TIME)), abs=1e-11)


@pytest.mark.parametrize("orders", [np.array([1]), np.array([1, 2, 3]), np.array([2, 7, 90])], ids=str)
def test_the_normal_equations_are_those_of_the_columns(orders: np.ndarray) -> None:
    phase = np.outer(TIME, W * orders)
    X = np.column_stack([np.ones(len(TIME)), np.cos(phase), np.sin(phase)])
    assert normal_matrix(phasors(W * TIME, int(orders.max())), orders) == pytest.approx(X.T @ X, abs=1e-8)


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
