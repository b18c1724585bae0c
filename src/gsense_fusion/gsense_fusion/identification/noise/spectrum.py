"""The gyro's noise spectrum from rest: white + flicker + random walk by Whittle likelihood below 4 Hz, smoothed above.

What is there at rest is noise, not a missing effect: tones at rest are notched and listed.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.special import digamma, polygamma

from gsense_fusion.identification.noise.tones import Tone, tones_of
from gsense_fusion.identification.types import BoolArray, FloatArray, IntArray

PARAMETRIC_BELOW_HZ = 4.0
ORDINATES_PER_BAND = 40
TRIM = 5.0
"""A tone counts for no more than this many times the level of its band."""
ROUGHNESS = tuple(10.0**x for x in np.arange(-6.0, 2.01, 0.5))
"""Variances of ln(shape) an octave that are tried: from a flat spectrum to any."""
CLEAR_OF_ROUNDING = 2.0
"""Of the rounding's density, that a spectrum must have: noise that blurs the step at every sample has more."""
CLEAR_OF_LEAKS = 1e-3
"""Of the density at low frequencies: under that a window's edges leave most of the power, which is no noise. A drift
leaks more of it than the rest did, and weighed by so little it would speak at every order."""
_FLOOR = 1e-18


@dataclass(frozen=True)
class NoiseModel:
    """One-sided power spectral density of one gyro axis in (rad/s)^2/Hz: (white + flicker/f + walk/f^2) shape(f)."""

    white: float
    """(rad/s)^2/Hz."""
    flicker: float
    """(rad/s)^2."""
    walk: float
    """(rad/s)^2 Hz; a rate random walk q in rad/s/sqrt(s) has walk = q^2 / (2 pi^2)."""
    shape_hz: FloatArray
    shape: FloatArray
    """Ratio of the smoothed spectrum to the parametric one at `shape_hz` (the sensor's filter)."""
    tones: tuple[Tone, ...] = ()
    covariance: FloatArray | None = None
    """Of ln(shape) at `shape_hz`, shape (k, k); None where it is exact."""
    rounding: float = 0.0
    """Density that rounding to the output's step has at most, (rad/s)^2/Hz: behind a narrow filter it is all there is.
    A signal that moves through the steps spreads it to other frequencies than one at rest."""

    def psd(self, frequency: FloatArray) -> FloatArray:
        """One-sided density at the frequencies in Hz (> 0)."""
        f = np.maximum(frequency, 1e-6)
        base = self.white + self.flicker / f + self.walk / f**2
        return np.asarray(base * np.interp(f, self.shape_hz, self.shape))

    def variance(self, frequency: FloatArray) -> FloatArray:
        """Relative variance of the density at the frequencies in Hz, as short rest leaves it, shape (n,)."""
        c = self.covariance
        if c is None or len(self.shape_hz) < 2:
            return np.zeros(len(frequency))
        i, part = self._place(frequency)
        return np.asarray((1 - part) ** 2 * c[i, i] + 2 * part * (1 - part) * c[i, i + 1] + part**2 * c[i + 1, i + 1])

    def variance_between(self, one: FloatArray, other: FloatArray) -> float:
        """Of the ratio of two mean powers over the density, taken at these and at those frequencies in Hz."""
        c = self.covariance
        if c is None or len(self.shape_hz) < 2 or not len(one) or not len(other):
            return 0.0
        share = self._shares(one) - self._shares(other)
        return float(share @ c @ share)

    def _shares(self, frequency: FloatArray) -> FloatArray:
        """What each point of the shape contributes to the mean over the frequencies, shape (k,)."""
        (i, part), k = self._place(frequency), len(self.shape_hz)
        return np.asarray((np.bincount(i, 1 - part, k) + np.bincount(i + 1, part, k)) / len(frequency))

    def _place(self, frequency: FloatArray) -> tuple[IntArray, FloatArray]:
        """The point of the shape before each frequency, and how far it lies towards the next."""
        last = len(self.shape_hz) - 1
        at = np.interp(frequency, self.shape_hz, np.arange(last + 1.0))
        i = np.minimum(at.astype(int), last - 1)
        return i, np.asarray(at - i)

    def usable(self, frequency: FloatArray, resolution_hz: float) -> BoolArray:
        """False around the tones that are there at rest too, and where rounding or leaks are most of the noise."""
        leaks = CLEAR_OF_LEAKS * float(self.psd(np.array([PARAMETRIC_BELOW_HZ]))[0])
        keep = np.asarray(self.psd(frequency) >= max(CLEAR_OF_ROUNDING * self.rounding, leaks))
        for tone in self.tones:
            keep &= np.abs(frequency - tone.frequency_hz) > tone.reach_hz(resolution_hz)
        return keep


@dataclass(frozen=True)
class Periodogram:
    """Ordinates of one window without its mean and trend."""

    frequency: FloatArray
    power: FloatArray
    """One-sided, (rad/s)^2/Hz."""


def periodogram(series: FloatArray, rate_hz: float) -> Periodogram:
    """One-sided periodogram of a window, mean and straight line removed, without zero and Nyquist frequency."""
    n = len(series)
    t = np.linspace(-1, 1, n)
    residual = series - series.mean() - t * float(t @ series) / float(t @ t)
    inner = slice(1, (n + 1) // 2)
    spectrum = np.fft.rfft(residual)[inner]
    return Periodogram(np.fft.rfftfreq(n, 1 / rate_hz)[inner], 2 * np.abs(spectrum) ** 2 / (rate_hz * n))


def fit_noise(windows: Sequence[FloatArray], rate_hz: float, masks: Sequence[BoolArray] | None = None) -> NoiseModel:
    """Fit the model of one axis to windows at rest.

    Args:
        windows: Series in rad/s, each of shape (n_i,).
        rate_hz: Sample rate.
        masks: For each window which ordinates count (drive orders excluded); all where None.

    Returns:
        The model; of no number where no ordinate lies below `PARAMETRIC_BELOW_HZ`.

    """
    grams = [periodogram(w, rate_hz) for w in windows]
    frequency = np.concatenate([g.frequency for g in grams])
    power = np.maximum(np.concatenate([g.power for g in grams]), _FLOOR)
    if masks is not None:
        keep = np.concatenate(list(masks))
        frequency, power = frequency[keep], power[keep]
    order = np.argsort(frequency, kind="stable")
    frequency, power = frequency[order], power[order]
    low = frequency < PARAMETRIC_BELOW_HZ
    if not low.any():
        return NoiseModel(np.nan, np.nan, np.nan, np.ones(1), np.ones(1))
    white, flicker, walk = _whittle(frequency[low], power[low])
    shape_hz, shape, covariance = _shape(frequency, power, (white, flicker, walk))
    model = NoiseModel(white, flicker, walk, shape_hz, shape, (), covariance)
    return replace(model, tones=tones_of([(g.frequency, g.power / model.psd(g.frequency)) for g in grams]))


def _whittle(frequency: FloatArray, power: FloatArray) -> tuple[float, float, float]:
    """Maximum of the Whittle likelihood over positive white, flicker and walk."""
    level = float(np.mean(power))

    def cost(p: FloatArray) -> tuple[float, FloatArray]:
        e = np.exp(p)
        parts = np.stack([np.full_like(frequency, e[0]), e[1] / frequency, e[2] / frequency**2])
        s = parts.sum(axis=0)
        return float(np.sum(np.log(s) + power / s)), parts @ (1 / s - power / s**2)

    start = np.log([level, level * 1e-2, level * 1e-4])
    bounds = [(np.log(level * 1e-3), np.log(level * 30)), (np.log(level * 1e-7), np.log(level * 10))]
    bounds.append((np.log(level * 1e-9), np.log(level * 10)))
    best = minimize(cost, start, jac=True, method="L-BFGS-B", bounds=bounds).x
    return float(np.exp(best[0])), float(np.exp(best[1])), float(np.exp(best[2]))


def _shape(
    frequency: FloatArray, power: FloatArray, base: tuple[float, float, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Smoothed ratio above 4 Hz with the covariance of its logarithm, from bands at least a twelfth of an octave wide.

    Bands of 40 ordinates alone are off by a sixth each: the smoothness that they show together is used.
    """
    high = frequency >= PARAMETRIC_BELOW_HZ
    f, p = frequency[high], power[high]
    if len(f) < ORDINATES_PER_BAND:
        return np.array([PARAMETRIC_BELOW_HZ]), np.array([1.0]), np.zeros((1, 1))
    ratio = p / (base[0] + base[1] / f + base[2] / f**2)
    edges = [0]
    while edges[-1] < len(f):
        start = edges[-1]
        wide = int(np.searchsorted(f, f[start] * 2 ** (1 / 12)))
        edges.append(min(len(f), max(wide, start + ORDINATES_PER_BAND)))
    if len(edges) > 2 and edges[-1] - edges[-2] < ORDINATES_PER_BAND:
        del edges[-2]
    bands = list(itertools.pairwise(edges))
    count = np.array([b - a for a, b in bands])
    centre = np.array([float(np.mean(f[a:b])) for a, b in bands])
    level = np.array([_level(ratio[a:b]) for a, b in bands])
    if not np.isfinite(level).all():  # no ordinate below, or none at all: `noise_at_rest` says so
        return np.array([PARAMETRIC_BELOW_HZ]), np.array([np.nan]), np.zeros((1, 1))
    value, covariance = _smooth(np.log2(centre / PARAMETRIC_BELOW_HZ), level, count, 1.0 / max(int((~high).sum()), 1))
    return np.append(PARAMETRIC_BELOW_HZ, centre), np.append(1.0, np.exp(value)), covariance


def _level(ratio: FloatArray) -> float:
    """Mean of exponential ordinates without what tones add."""
    limit = TRIM * float(np.median(ratio)) / np.log(2)
    return float(np.mean(np.minimum(ratio, limit))) / (1.0 - np.exp(-TRIM))


def _smooth(octave: FloatArray, level: FloatArray, count: FloatArray, joint: float) -> tuple[FloatArray, FloatArray]:
    """Logarithm of a spectrum as a random walk over octaves, its roughness by maximum likelihood.

    Args:
        octave: Where the bands are, from the point at which the walk begins at zero, shape (k,).
        level: Mean of each band's ordinates, shape (k,).
        count: Their numbers, shape (k,).
        joint: Variance of that zero: the level below it is an estimate too.

    Returns:
        Its mean (k,) and its covariance with the point of zero before it (k + 1, k + 1).

    """
    y = np.log(np.maximum(level, _FLOOR)) - (digamma(count) - np.log(count))
    error = np.diag(polygamma(1, count))
    walk = np.minimum(octave[:, None], octave[None])

    def solved(roughness: float) -> tuple[float, FloatArray, FloatArray]:
        prior = roughness * walk + joint
        factor = cho_factor(prior + error, lower=True)
        cost = float(y @ cho_solve(factor, y)) + 2 * float(np.sum(np.log(np.diag(factor[0]))))
        return cost, prior @ cho_solve(factor, y), prior - prior @ cho_solve(factor, prior)

    _, value, covariance = min((solved(r) for r in ROUGHNESS), key=lambda s: s[0])
    whole = np.zeros((len(y) + 1, len(y) + 1))
    whole[0, 0] = joint
    whole[1:, 1:] = covariance
    return value, whole


def at_least(model: NoiseModel, white: float) -> NoiseModel:
    """A model nowhere below a white density in (rad/s)^2/Hz: the rounding of a signal that rests on one value."""
    if white <= 0.0:
        return model
    return replace(model, white=max(model.white, white), shape=np.maximum(model.shape, 1.0))


def scaled(model: NoiseModel, factor: float) -> NoiseModel:
    """The same spectrum with its power multiplied."""
    return replace(model, white=model.white * factor, flicker=model.flicker * factor, walk=model.walk * factor)
