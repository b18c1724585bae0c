"""The whitened residual of a fitted model, window by window: what the sufficiency tests look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsense_fusion.identification.campaign import RunData, Window, slice_drivers
from gsense_fusion.identification.effects.base import Drivers
from gsense_fusion.identification.likelihood import Fit, Likelihood
from gsense_fusion.identification.types import BoolArray, FloatArray
from gsense_fusion.identification.whitened import USED_BAND, Bins, project_out_slow, stack, whiten, window_bins

HALF_ORDERS = np.arange(0.5, 10.01, 0.5)
LEVEL_BINS = 60
"""Bins that say how high the noise is beside a line."""


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
        """Bins that no order of the drive can reach (half-orders to 10, whole ones beyond), shape (m,)."""
        w = self.angular_frequency
        if w is None:
            return np.ones(len(self.frequency), dtype=bool)
        order = self.frequency * 2 * np.pi / w
        width = bins * self.resolution_hz * 2 * np.pi / w
        from_half = np.abs(order - np.maximum(np.rint(2 * order), 1.0) / 2)
        keep = (from_half > width) | (order > HALF_ORDERS[-1] + width)
        if width < 0.25:  # a slow drive's orders lie so close that leaving them out would leave nothing
            keep &= np.abs(order - np.maximum(np.rint(order), 1.0)) > width
        return np.asarray(keep)


def residuals(likelihood: Likelihood, fit: Fit, runs: Sequence[RunData]) -> list[WindowResidual]:
    """Whitened residuals of all windows of at least four seconds, up to 0.4 of the sample rate."""
    out = []
    for data in runs:
        drivers = likelihood.source.of(data, fit.templates)
        for window in data.windows:
            if len(window) < 4.0 * data.run.rate_hz:
                continue
            part = slice_drivers(drivers, window)
            X = stack(likelihood.effects, part)
            error = data.run.angular_rate[window.start : window.stop] - X @ fit.beta_in(data.mounting_number)
            bins = window_bins(len(window), data.run.rate_hz, likelihood.noise, USED_BAND * data.run.rate_hz)
            rows = project_out_slow(whiten(error[:, :, None], bins), len(window), bins)[:, :, 0]
            result = WindowResidual(data, window, bins, rows.reshape(2, -1, 3))
            felt = _felt_beyond_the_drive(likelihood, fit, result, part)
            out.append(replace(result, spectrum=result.spectrum - felt))
    return out


def _felt_beyond_the_drive(likelihood: Likelihood, fit: Fit, residual: WindowResidual, part: Drivers) -> FloatArray:
    """G times what the accelerometer feels away from the drive's orders (a belt that rings), whitened, shape (2, m, 3).

    The encoder's harmonics do not reach there; it is the declared G f all the same, and no symptom.
    """
    data, window, bins = residual.data, residual.window, residual.bins
    if "g_sensitivity" not in fit.names or part.specific_force is None or not window.moving:
        return np.zeros_like(residual.spectrum)
    first = likelihood.columns.start["g_sensitivity"]
    G = fit.beta_in(data.mounting_number)[first : first + 9].reshape(3, 3)
    felt = data.run.specific_force[window.start : window.stop] - part.specific_force
    late = np.exp(-2j * np.pi * bins.frequency * fit.templates.gyro_delay_s)
    spectrum = np.fft.rfft(felt, axis=0)[bins.keep] * (late * residual.away_from_orders())[:, None]
    white = (spectrum @ G.T) * bins.weight
    return np.stack([white.real, white.imag])


@dataclass(frozen=True)
class LineEnergy:
    """A sine in a window's residual, per axis, each of shape (3,)."""

    energy: FloatArray
    """Whitened energy over the local level of the noise."""
    calibrated: FloatArray
    """The same as chi-square with two degrees of freedom where no line is: the level is an estimate from few bins."""
    amplitude_squared: FloatArray
    """(rad/s)^2."""


def line_energy(residual: WindowResidual, frequency_hz: float) -> LineEnergy:
    """Energy of a sine at any frequency, between bins too.

    The local level comes from bins that the drive cannot reach; it is never taken below one: a spectrum that the rest
    records overestimate proves nothing, one that they underestimate must not raise alarms.
    """
    n, rate = len(residual.window), residual.data.run.rate_hz
    phase = 2 * np.pi * frequency_hz * np.arange(n) / rate
    tones = np.repeat(np.stack([np.cos(phase), np.sin(phase)], axis=1)[:, None, :], 3, axis=1)
    rows = project_out_slow(whiten(tones, residual.bins), n, residual.bins)
    data = residual.spectrum.reshape(-1, 3)
    free = np.flatnonzero(residual.away_from_orders())
    near = free[np.argsort(np.abs(np.log(residual.frequency[free] / frequency_hz)))[:LEVEL_BINS]]
    energy, calibrated, amplitude = np.zeros(3), np.zeros(3), np.zeros(3)
    for axis in range(3):
        X = rows[:, axis, :]
        if not X.any():
            continue
        beta = np.linalg.solve(X.T @ X, X.T @ data[:, axis])
        m = max(len(near), 1)
        level = max(1.0, float(np.mean(residual.power[near, axis]))) if len(near) else 1.0
        energy[axis] = float(np.sum((X @ beta) ** 2)) / level
        # F with (2, 2m) degrees of freedom has the tail (1 + F/m)^-m; chi-square with 2 has exp(-x/2)
        calibrated[axis] = 2 * m * np.log1p(energy[axis] / 2 / m)
        amplitude[axis] = float(beta @ beta)
    return LineEnergy(energy, calibrated, amplitude)
