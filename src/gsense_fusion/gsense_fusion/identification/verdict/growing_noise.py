"""Does the noise grow with the speed from run to run? Pooled over all of them, slow ones hide what fast ones show."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import norm

from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.likelihood.model import Likelihood
from gsense_fusion.identification.types import AXES, FloatArray
from gsense_fusion.identification.verdict.fast_part import away_above
from gsense_fusion.identification.verdict.residual import WindowResidual
from gsense_fusion.identification.verdict.uneven_noise import CONFIRMED_ALPHA, Uneven, excess_rms

MODEL_ERROR = 0.02
"""Relative error of the spectrum beyond what its ordinates say (`NoiseModel.covariance`): noise is not quite steady."""
LEAST_BINS = 30
LEAST_WINDOWS = 4


def growing_noise(likelihood: Likelihood, windows: Sequence[WindowResidual]) -> list[Uneven]:
    """Power above 5 Hz of all windows, at rest and in motion, against their mean square speed.

    Their common level is free, each has an error of its own, and a scatter beyond it counts as error. One-sided, each
    axis and the mean of all; empty where too few windows tell, or one alone does: a loud run is no growth.
    """
    used = [(w, away_above(w)) for w in windows]
    told = [(w, u, (w.bins.weight[u] > 0).sum(axis=0)) for w, u in used if u.sum() >= LEAST_BINS]
    axes = list(likelihood.noise)
    told = [(w, u, count) for w, u, count in told if count[axes].min() >= LEAST_BINS]
    if len(told) < LEAST_WINDOWS:
        return []
    driver = np.array([mean_square_speed(likelihood, w) for w, _, _ in told])
    if np.ptp(driver) <= 0.0:
        return []
    count = np.array([c[axes] for _, _, c in told], dtype=float)
    power = np.array([w.unfolded[u][:, axes].sum(axis=0) for w, u, _ in told])
    level = np.column_stack([power / count, power.sum(axis=1) / count.sum(axis=1)])
    variance = 1.0 / np.column_stack([count, count.sum(axis=1)]) + MODEL_ERROR**2
    slope, error = _trend(driver, level, variance)
    if float(norm.sf(_without_one(driver, level, variance).max())) > CONFIRMED_ALPHA:
        return []
    best = int(np.argmax(slope[:-1] / error[:-1]))
    fastest, bins, _ = told[int(np.argmax(driver))]
    excess = float(max(slope[best], 0.0) * np.ptp(driver))
    p = float(norm.sf(float(np.max(slope / error))))
    words = f"more noise the faster the run is, most on {AXES[axes[best]]}"
    return [Uneven(p, axes[best], excess_rms(fastest, bins, axes[best], excess), words).after(level.shape[1])]


def mean_square_speed(likelihood: Likelihood, residual: WindowResidual) -> float:
    """Of the carriage in a window, (m/s)^2."""
    velocity = likelihood.source.of(residual.data, Templates()).kinematics.velocity
    return float(np.mean(velocity[residual.window.start : residual.window.stop] ** 2))


def _trend(driver: FloatArray, level: FloatArray, variance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slope of levels (w, k) of some variance (w, k) on a driver (w,), and its error, (k,) each."""
    weight = 1.0 / variance
    x = driver[:, None] - np.average(np.broadcast_to(driver[:, None], level.shape), axis=0, weights=weight)
    square = np.maximum(np.sum(weight * x**2, axis=0), 1e-30)
    slope = np.sum(weight * x * level, axis=0) / square
    left = level - np.average(level, axis=0, weights=weight) - slope * x
    scatter = np.sum(weight * left**2, axis=0) / (len(driver) - 2)
    return slope, np.sqrt(np.maximum(scatter, 1.0) / square)


def _without_one(driver: FloatArray, level: FloatArray, variance: FloatArray) -> FloatArray:
    """Slope in standard errors without the window that makes it largest, shape (k,); arguments as `_trend`."""
    out = np.full(level.shape[1], np.inf)
    for i in range(len(driver)):
        slope, error = _trend(np.delete(driver, i), np.delete(level, i, axis=0), np.delete(variance, i, axis=0))
        out = np.minimum(out, slope / error)
    return out
