"""What vibration makes of the gyro is taken off its residual, in each mounting with a response of its own."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from gsense_fusion.identification.verdict.coherent import Extra, without_coherent
from gsense_fusion.identification.verdict.residual import WindowResidual

FREQUENCY = np.arange(40.0, 60.0, 0.03)
WHOLE = (FREQUENCY > 42.0) & (FREQUENCY < 58.0)
"""Away from the bands at the ends, which have too few bins."""
TURN = np.diag([-1.0, -1.0, 1.0])


def _noise(rng: np.random.Generator, size: float = 1.0) -> np.ndarray:
    shape = (len(FREQUENCY), 3)
    return np.asarray(size * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)))


def _window(spectrum: np.ndarray, mounting: int, moving: bool) -> WindowResidual:
    data = SimpleNamespace(mounting_number=mounting, motion=None, run=SimpleNamespace(rate_hz=200.0))
    bins = SimpleNamespace(frequency=FREQUENCY, weight=np.ones((len(FREQUENCY), 3)))
    parts: Any = (data, SimpleNamespace(moving=moving), bins)
    return WindowResidual(*parts, np.stack([spectrum.real, spectrum.imag]))


def _session(of_the_rig: float, felt_noise: float, seed: int) -> list[WindowResidual]:
    """Vibration along the rail in two mountings, the board turned about the vertical, and rest in each."""
    rng = np.random.default_rng(seed)
    windows, extras = [], []
    for mounting, turn in ((0, np.eye(3)), (1, TURN)):
        for moving in (True, True, False):
            shaken = np.zeros((len(FREQUENCY), 3), dtype=complex)
            shaken[:, 0] = 5.0 * moving * _noise(rng)[:, 0]
            response = of_the_rig * np.outer(shaken[:, 0], [0.0, 1.0, 1.0]) @ turn
            felt = shaken @ turn + _noise(rng, felt_noise)
            windows.append(_window(_noise(rng) + response, mounting, moving))
            extras.append(Extra(felt, np.zeros_like(felt)))
    return without_coherent(windows, cast("list[Extra]", extras))


def _mean(windows: list[WindowResidual], moving: bool) -> np.ndarray:
    chosen = [w.power[WHOLE] for w in windows if w.window.moving == moving]
    return np.asarray(np.mean(np.concatenate(chosen), axis=0))


@pytest.mark.parametrize("seed", range(3))
def test_what_the_rig_makes_of_a_vibration_is_no_noise_in_a_turned_board(seed: int) -> None:
    windows = _session(of_the_rig=2.0, felt_noise=0.0, seed=seed)
    assert _mean(windows, moving=True) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("seed", range(3))
def test_the_accelerometers_noise_counts_at_rest_too(seed: int) -> None:
    """With a response of 2 it adds 4 times its own power to what is left, in motion and at rest."""
    windows = _session(of_the_rig=2.0, felt_noise=0.5, seed=seed)
    motion, rest = _mean(windows, moving=True), _mean(windows, moving=False)
    assert motion[1:] == pytest.approx(2.0, rel=0.12)
    assert rest[1:] == pytest.approx(motion[1:], rel=0.12)


@pytest.mark.parametrize("seed", range(3))
def test_noise_alone_keeps_its_power(seed: int) -> None:
    windows = _session(of_the_rig=0.0, felt_noise=1.0, seed=seed)
    assert _mean(windows, moving=True) == pytest.approx(1.0, abs=0.08)
    assert _mean(windows, moving=False) == pytest.approx(1.0, abs=0.1)
