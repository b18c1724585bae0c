"""Energy of the residual at whole orders of the drive, against the noise beside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import f as f_distribution

from gsense_fusion.identification.types import FloatArray

from .window import Steady

HIGHEST_ORDER = 8
LEVEL_BINS = 12
USED_BAND = 0.4
"""Share of the sample rate up to which the sensor's filter lets anything through."""


@dataclass(frozen=True)
class OrderEnergies:
    """The residual's harmonics of one window."""

    order: FloatArray
    """Shape (k,)."""
    coefficient: FloatArray
    """Cosine and sine amplitudes, rad/s, shape (2, k, 3)."""
    level: FloatArray
    """Variance of one amplitude where there is only noise, (rad/s)^2, shape (k, 3)."""
    p_value: FloatArray
    """Chance of so much energy from noise, the three axes together, shape (k,)."""
    remainder: FloatArray
    """Residual less its harmonics and a slow parabola, rad/s, shape (n, 3)."""
    projector: FloatArray
    """Takes a series (n,) to its amplitudes (2 k,): all cosines, then all sines."""

    @property
    def energy(self) -> FloatArray:
        """Squared amplitudes over the noise's variance, three axes, shape (k,); 6 on average where only noise is."""
        return np.asarray(np.sum(self.coefficient**2 / self.level, axis=(0, 2)))


def order_energies(steady: Steady, w: float) -> OrderEnergies:
    """Harmonics of a window whose drive has the angular frequency w [rad/s], by least squares.

    Their significance is that of F-tests against neighbouring bins.
    """
    n = len(steady.time)
    highest = min(HIGHEST_ORDER, int(USED_BAND * steady.rate_hz * 2 * np.pi / w))
    order = np.arange(1.0, highest + 1.0)
    t = steady.time - steady.time.mean()
    phase = np.outer(t, w * order)
    slow = np.vander(t / t[-1], 3)
    basis = np.column_stack([np.cos(phase), np.sin(phase), slow])
    inverse = np.linalg.solve(basis.T @ basis, basis.T)  # nearly orthogonal columns
    beta = inverse @ steady.residual
    remainder = steady.residual - basis @ beta
    k = len(order)
    coefficient = np.stack([beta[:k], beta[k : 2 * k]])
    level, bins = _levels(remainder, steady.rate_hz, w, order)
    level = 2.0 * level / n
    energy = np.sum(coefficient**2 / level, axis=(0, 2))
    p_value = f_distribution.sf(energy / 6.0, 6, 2 * 3 * bins)
    return OrderEnergies(order, coefficient, level, np.asarray(p_value), remainder, inverse[: 2 * k])


def _levels(remainder: FloatArray, rate_hz: float, w: float, order: FloatArray) -> tuple[FloatArray, int]:
    """Mean of the periodogram beside each order, shape (k, 3), and from how many bins."""
    n = len(remainder)
    power = np.abs(np.fft.rfft(remainder, axis=0)) ** 2 / n
    frequency = np.fft.rfftfreq(n, 1.0 / rate_hz)
    at = frequency * 2 * np.pi / w
    free = np.abs(at - np.rint(at)) * w / (2 * np.pi) > 1.5 * rate_hz / n
    free &= np.arange(len(power)) >= 3  # the parabola took these
    candidates = np.flatnonzero(free)
    if len(candidates) < LEVEL_BINS:
        candidates = np.arange(3, len(power))
    level = []
    for f in order * w / (2 * np.pi):
        near = candidates[np.argsort(np.abs(frequency[candidates] - f))[:LEVEL_BINS]]
        level.append(power[near].mean(axis=0))
    return np.array(level), LEVEL_BINS
