"""The whitened residual of a fitted model, window by window: what the sufficiency tests look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.campaign import RunData, Window, slice_drivers
from gsense_fusion.identification.likelihood import Fit, Likelihood
from gsense_fusion.identification.types import BoolArray, FloatArray
from gsense_fusion.identification.whitened import USED_BAND, Bins, project_out_slow, whiten, window_bins

HALF_ORDERS = np.arange(0.5, 10.01, 0.5)


@dataclass(frozen=True, eq=False)
class WindowResidual:
    """One window's residual as whitened Fourier coefficients."""

    data: RunData
    window: Window
    bins: Bins
    spectrum: FloatArray
    """Real and imaginary parts of unit variance where the model is complete, shape (2, m, 3); zero for absent axes."""

    @property
    def frequency(self) -> FloatArray:
        """Hz, shape (m,)."""
        return self.bins.frequency

    @property
    def power(self) -> FloatArray:
        """Squared modulus over its expectation, shape (m, 3): exponential with mean one."""
        return np.asarray(np.sum(self.spectrum**2, axis=0) / 2.0)

    @property
    def resolution_hz(self) -> float:
        """Distance of the bins."""
        return self.data.run.rate_hz / len(self.window)

    @property
    def angular_frequency(self) -> float | None:
        """Of the drive in rad/s."""
        if not self.window.moving or self.data.motion is None:
            return None
        return self.data.motion.angular_frequency

    def away_from_orders(self, bins: float = 2.5) -> BoolArray:
        """Bins that no half-order of the drive (1/2 to 10) can reach, shape (m,)."""
        w = self.angular_frequency
        keep = np.ones(len(self.frequency), dtype=bool)
        if w is not None:
            for order in HALF_ORDERS:
                keep &= np.abs(self.frequency - order * w / (2 * np.pi)) > bins * self.resolution_hz
        return keep


def residuals(likelihood: Likelihood, fit: Fit, runs: Sequence[RunData]) -> list[WindowResidual]:
    """Whitened residuals of all windows of at least four seconds, up to 0.4 of the sample rate."""
    out = []
    for data in runs:
        drivers = likelihood.source.of(data, fit.templates)
        for window in data.windows:
            if len(window) < 4.0 * data.run.rate_hz:
                continue
            part = slice_drivers(drivers, window)
            X = np.concatenate([effect.design(part) for effect in likelihood.effects], axis=2)
            error = data.run.angular_rate[window.start : window.stop] - X @ fit.beta_in(data.mounting_number)
            bins = window_bins(len(window), data.run.rate_hz, likelihood.noise, USED_BAND * data.run.rate_hz)
            rows = project_out_slow(whiten(error[:, :, None], bins), len(window), bins)[:, :, 0]
            out.append(WindowResidual(data, window, bins, rows.reshape(2, -1, 3)))
    return out


def line_energy(residual: WindowResidual, frequency_hz: float) -> tuple[FloatArray, FloatArray]:
    """Whitened energy of a sine at any frequency (between bins too) and its squared amplitude, per axis, shape (3,).

    The energy is chi-square with two degrees of freedom where no line is, over the local level of the noise (never
    below one: a spectrum that the rest records underestimate must not raise alarms).
    """
    n, rate = len(residual.window), residual.data.run.rate_hz
    t = np.arange(n) / rate
    phase = 2 * np.pi * frequency_hz * t
    tones = np.repeat(np.stack([np.cos(phase), np.sin(phase)], axis=1)[:, None, :], 3, axis=1)
    rows = project_out_slow(whiten(tones, residual.bins), n, residual.bins)
    data = residual.spectrum.reshape(-1, 3)
    near = residual.away_from_orders() & (np.abs(residual.frequency - frequency_hz) < max(0.5, 0.5 * frequency_hz))
    energy, amplitude = np.zeros(3), np.zeros(3)
    for axis in range(3):
        X = rows[:, axis, :]
        if not X.any():
            continue
        beta = np.linalg.solve(X.T @ X, X.T @ data[:, axis])
        level = max(1.0, float(np.mean(residual.power[near, axis]))) if near.sum() >= 20 else 1.0
        energy[axis] = float(np.sum((X @ beta) ** 2)) / level
        amplitude[axis] = float(beta @ beta)
    return energy, amplitude
