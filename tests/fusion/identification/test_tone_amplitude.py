"""How large a tone is: in each run on all axes together, over all runs on each of them."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.effects.line_tone import _Sine, _sizes

RUNS = 4000


def _seen(true: np.ndarray, stderr: np.ndarray) -> np.ndarray:
    """Amplitude and standard error in each run of a tone of some size on each axis, shape (RUNS, 2)."""
    rng = np.random.default_rng(17)
    spread = np.where(np.isfinite(stderr), stderr, 0.0)
    noise = spread * (rng.standard_normal((RUNS, 3)) + 1j * rng.standard_normal((RUNS, 3)))
    return np.array([_Sine(true + n, stderr).all_axes() for n in noise])


@pytest.mark.parametrize("true", [np.array([1.8, -3.6, 3.9j]), np.array([0.0, 0.0, 6.0])])
def test_it_is_unbiased_and_as_sure_as_it_says(true: np.ndarray) -> None:
    amplitude, stderr = _seen(true, np.ones(3)).T
    assert amplitude.mean() == pytest.approx(np.linalg.norm(true), rel=0.03)
    assert amplitude.std() == pytest.approx(stderr[0], rel=0.1)


def test_a_weak_tone_on_all_axes_is_there_in_every_run() -> None:
    amplitude, stderr = _seen(np.array([1.8, -3.6, 3.9j]), np.ones(3)).T
    assert np.mean(amplitude > 0.5 * np.median(amplitude) + stderr) > 0.9


def test_an_axis_that_is_not_there_counts_for_nothing() -> None:
    amplitude, stderr = _seen(np.array([0.0, 0.0, 5.0]), np.array([np.inf, np.inf, 1.0])).T
    assert np.all(stderr == 1.0)
    assert amplitude.mean() == pytest.approx(5.0, rel=0.03)


def test_a_weak_axis_is_told_by_the_strongest_one() -> None:
    """Of its own square most is noise: what is left of that is none of the size, and has no sign."""
    true, runs = np.array([0.6, -4.0, 0.0]), 12
    rng = np.random.default_rng(23)
    sizes, errors = [], []
    for _ in range(500):
        phase = np.exp(2j * np.pi * rng.random((runs, 1)))
        noise = rng.standard_normal((runs, 3)) + 1j * rng.standard_normal((runs, 3))
        size, error = _sizes([_Sine(c, np.ones(3)) for c in true * phase + noise], 1)
        sizes.append(-size)
        errors.append(error)
    assert np.mean(sizes, axis=0) == pytest.approx(true, abs=4 * np.std(sizes) / np.sqrt(500) + 0.02)
    assert np.std(sizes, axis=0) == pytest.approx(np.mean(errors, axis=0), rel=0.15)
