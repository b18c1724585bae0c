"""The frequencies of a window and the whitening of its rows."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import rfft

from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import BoolArray, FloatArray

LOWEST_HZ = 0.04
HIGHEST_HZ = 25.0
USED_BAND = 0.4
"""Bins up to this part of the sample rate are used."""


@dataclass(frozen=True)
class Bins:
    """The frequencies of a window that are used and the whitening of each axis."""

    keep: BoolArray
    frequency: FloatArray
    weight: FloatArray
    """Multiplies the rfft so that real and imaginary parts have unit variance, shape (bins, 3)."""
    samples: int
    """Of the window."""
    noise: Mapping[int, NoiseModel]
    """What the axes were whitened by."""

    @cached_property
    def variance(self) -> FloatArray:
        """Relative variance of the density that each bin was whitened by, shape (bins, 3)."""
        out = np.zeros((len(self.frequency), 3))
        for axis, model in self.noise.items():
            out[:, axis] = model.variance(self.frequency)
        return out

    @cached_property
    def both(self) -> FloatArray:
        """Weight of real parts, then of imaginary ones, shape (2 * bins, 3)."""
        return np.asfortranarray(np.concatenate([self.weight, self.weight]))

    @cached_property
    def slow(self) -> tuple[FloatArray, ...]:
        """What a slope and a curvature span of each axis' whitened rows, orthonormal, shape (2 * bins, 2)."""
        t = np.linspace(-1.0, 1.0, self.samples)
        bases = np.moveaxis(whiten_alike(np.stack([t, t**2]), self), 1, 0)
        return tuple(np.linalg.qr(basis)[0] for basis in bases)


def window_bins(n: int, rate_hz: float, noise: Mapping[int, NoiseModel], highest_hz: float = HIGHEST_HZ) -> Bins:
    """Bins of a window of n samples."""
    frequency = np.fft.rfftfreq(n, 1 / rate_hz)
    resolution = rate_hz / n
    keep = (frequency >= max(LOWEST_HZ, 0.5 * resolution)) & (frequency <= min(highest_hz, USED_BAND * rate_hz))
    weight = np.zeros((int(keep.sum()), 3))
    for axis, model in noise.items():
        f = frequency[keep]
        weight[:, axis] = np.sqrt(4.0 / (rate_hz * n * model.psd(f))) * model.usable(f, resolution)
    return Bins(keep, frequency[keep], weight, n, noise)


def whiten_alike(series: FloatArray, bins: Bins) -> FloatArray:
    """The same for k series (k, n) that are alike on all axes."""
    spectrum = rfft(series, axis=1)[:, bins.keep].T[:, None, :] * bins.weight[:, :, None]
    return np.concatenate([spectrum.real, spectrum.imag], axis=0)


def rows_by_axis(series: FloatArray, bins: Bins, axes: Collection[int]) -> FloatArray:
    """Whitened rows (len(axes), 2 * bins, k) of k series (k, n) as each axis weighs them, slow parts projected out."""
    varies = (series != series[:, :1]).any(axis=1)  # gravity does not, nor a step before or after the window
    if not varies.all():
        out = np.zeros((len(axes), 2 * len(bins.frequency), len(series)))
        if varies.any():
            out[:, :, varies] = rows_by_axis(series[varies], bins, axes)
        return out
    spectrum = rfft(series, axis=1)[:, bins.keep]
    return whitened(np.concatenate([spectrum.real, spectrum.imag], axis=1).T, bins, axes)


def whitened(parts: FloatArray, bins: Bins, axes: Collection[int]) -> FloatArray:
    """The same of real and imaginary parts (2 * bins, k)."""
    out = np.empty((len(axes), *parts.shape))
    for i, axis in enumerate(axes):
        np.multiply(parts, bins.both[:, axis, None], out=out[i])
        q = bins.slow[axis]
        out[i] -= q @ (q.T @ out[i])
    return out


def axis_rows(series: FloatArray, bins: Bins, axis: int) -> FloatArray:
    """Whitened rows (2 * bins, k) of k series (k, n) of one axis, slow parts projected out."""
    spectrum = rfft(series, axis=1)[:, bins.keep] * bins.weight[:, axis]
    rows = np.concatenate([spectrum.real, spectrum.imag], axis=1).T
    q = bins.slow[axis]
    return np.asarray(rows - q @ (q.T @ rows))
