"""Broadband noise that grows with the speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import norm

from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.effects.statistical import Explanation, Seen, StatisticalEffect
from gsense_fusion.identification.likelihood.model import Likelihood
from gsense_fusion.identification.types import AXES, FloatArray, IntArray, Owner, Parameter
from gsense_fusion.identification.verdict.fast_part import LOWEST_HZ, away_above, fast_part, in_blocks
from gsense_fusion.identification.verdict.growing_noise import mean_square_speed
from gsense_fusion.identification.verdict.residual import WindowResidual

BLOCK_S = 0.1
REWEIGHTED = 6
LEAST_MEAN = 0.1
"""Of the mean power: what a falling line is held above."""
SURE = 5.0
UNEVEN = "uneven"
"""Kind of symptom that goes with it: a rail's noise need not grow as v^2 in each narrow band."""
RIVAL_LOGLIK = 10.0
"""In twice the log-likelihood: a driver that is better by more than this refutes v^2."""


class SpeedNoise(StatisticalEffect):
    """Noise whose variance follows v^2: rolling of bearings and belt."""

    name = "speed_noise"
    owner = Owner.RIG
    equation = "variance s^2 v^2"
    source = "rolling noise of bearings: amplitude in proportion to speed"
    symptom = "band"

    def explain(self, seen: Seen) -> Explanation | None:
        """Power above 5 Hz in tenths of a second against v^2, |v|, a^2 and a constant of the motion."""
        likelihood, windows = seen.likelihood, seen.windows
        moving = [w for w in windows if w.window.moving]
        if not moving:
            return None
        drivers: dict[str, list[FloatArray]] = {"v2": [], "v": [], "a2": [], "on": []}
        power: list[FloatArray] = []
        for w in windows:
            kin = likelihood.source.of(w.data, Templates()).kinematics
            cut = slice(w.window.start, w.window.stop)
            v, a = kin.velocity[cut], kin.acceleration[cut]
            length = max(2, round(BLOCK_S * w.data.run.rate_hz))
            power.append(in_blocks(fast_part(w) ** 2, length))
            on = np.full(len(v), float(w.window.moving))
            for name, series in (("v2", v**2), ("v", np.abs(v)), ("a2", a**2), ("on", on)):
                drivers[name].append(in_blocks(_spread(w, series)[:, None], length)[:, 0])
        P = np.concatenate(power)
        fits = {name: _slope(np.concatenate(x), P) for name, x in drivers.items()}
        slope, error, loglik = fits["v2"]
        refuted = 2 * (max(f[2] for f in fits.values()) - loglik) > RIVAL_LOGLIK
        if refuted or float(slope.sum()) < SURE * float(np.linalg.norm(error)):
            return None
        size = np.array([_noise_rms(moving[0], axis) for axis in range(3)])
        s = np.sqrt(np.maximum(slope, 0.0)) * size
        spread = np.where(s > 0, 0.5 * error * size**2 / np.maximum(s, 1e-30), size * np.sqrt(error))
        parameters = {
            "s": Parameter(float(np.sqrt(np.mean(s**2))), float(np.linalg.norm(spread) / 3), "rad/s at 1 m/s")
        }
        bands = _band_slopes(likelihood, moving)
        level = 1.0 + max(float(b.max()) for b in bands.values()) * max(
            mean_square_speed(likelihood, w) for w in moving
        )
        z = float(slope.sum() / np.linalg.norm(error))
        axes = tuple(x for i, x in enumerate(AXES) if slope[i] > 3 * error[i])
        return Explanation(
            parameters, axes, float(norm.sf(z)), tuple(_scaled(likelihood, windows, bands)), 0.0, level, UNEVEN
        )


def _spread(residual: WindowResidual, variance: FloatArray) -> FloatArray:
    """Variance of white noise as the band that is looked at spreads it in time, shape (n,): at 25 Hz by 0.2 s."""
    n = len(residual.window)
    band = np.zeros(n // 2 + 1)
    band[np.flatnonzero(residual.bins.keep)] = away_above(residual)
    kernel = np.fft.irfft(band, n) ** 2
    if not kernel.any():
        return variance
    return np.asarray(np.fft.irfft(np.fft.rfft(variance) * np.fft.rfft(kernel / kernel.sum()), n))


def _slope(driver: FloatArray, power: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Slope of each axis' power on a driver beside a level, its error, and the log-likelihood of exponential powers.

    Power scatters in proportion to its mean: least squares would let the few loudest blocks decide between drivers.
    """
    slope, error, loglik = np.zeros(3), np.ones(3), 0.0
    X = np.column_stack([np.ones(len(driver)), driver])
    for axis in range(3):
        y = power[:, axis]
        if not y.any() or np.ptp(driver) <= 0:
            continue
        mean = np.full(len(y), float(y.mean()))
        for _ in range(REWEIGHTED):
            W = X / mean[:, None] ** 2
            inverse = np.linalg.inv(X.T @ W)
            level, rise = inverse @ (W.T @ y)
            mean = np.maximum(level + rise * driver, LEAST_MEAN * float(y.mean()))
        slope[axis] = rise
        # sandwich: blocks of one frequency band are neither exponential nor quite independent
        error[axis] = float(np.sqrt(np.sum((W @ inverse[1] * (y - mean)) ** 2)))
        loglik -= float(np.sum(np.log(mean) + y / mean))
    return slope, error, loglik


def _noise_rms(residual: WindowResidual, axis: int) -> float:
    """Noise of one sample, rad/s; what flicker adds below the band that is looked at does not grow with the speed."""
    model = residual.bins.noise.get(axis)
    if model is None:
        return 0.0
    n, rate_hz = len(residual.window), residual.data.run.rate_hz
    frequency = np.maximum(np.fft.rfftfreq(n, 1 / rate_hz)[1:], LOWEST_HZ)
    return float(np.sqrt(np.sum(model.psd(frequency)) * rate_hz / n))


def _octave(residual: WindowResidual) -> IntArray:
    """Octave of each frequency under half the sample rate, those under 5 Hz counted to the lowest above, shape (m,)."""
    top = 0.5 * residual.data.run.rate_hz
    return np.asarray(np.floor(np.log2(top / np.maximum(residual.frequency, LOWEST_HZ))), dtype=int)


def _band_slopes(likelihood: Likelihood, windows: Sequence[WindowResidual]) -> dict[int, FloatArray]:
    """Slope of each octave's power on v^2, by maximum likelihood, (3,) each.

    What the rails stir up need not have the spectrum of the sensor's own noise.
    """
    v2 = np.array([mean_square_speed(likelihood, w) for w in windows])
    out = {}
    for band in sorted({int(b) for w in windows for b in np.unique(_octave(w))}):
        used = [away_above(w) & (_octave(w) == band) for w in windows]
        count = np.array([u.sum() for u in used], dtype=float)[:, None]
        power = np.array([0.5 * np.sum(w.spectrum[:, u] ** 2, axis=(0, 1)) for w, u in zip(windows, used, strict=True)])
        out[band] = _growth(v2[:, None], power, count)
    return out


def _growth(driver: FloatArray, power: FloatArray, count: FloatArray) -> FloatArray:
    """Slope r >= 0 of sums of `count` exponential powers of mean 1 + r driver, shape (3,); arrays (w, 1) or (w, 3)."""
    slope = np.zeros(power.shape[1])
    for _ in range(REWEIGHTED):
        weight = driver / (1.0 + slope * driver) ** 2
        size = np.maximum(np.sum(weight * driver * count, axis=0), 1e-30)
        slope = np.maximum(np.sum(weight * (power - count), axis=0) / size, 0.0)
    return slope


def _scaled(
    likelihood: Likelihood, windows: Sequence[WindowResidual], bands: dict[int, FloatArray]
) -> list[WindowResidual]:
    out = []
    for w in windows:
        slope = np.array([bands.get(int(b), np.zeros(3)) for b in _octave(w)])
        out.append(replace(w, spectrum=w.spectrum / np.sqrt(1.0 + slope * mean_square_speed(likelihood, w))))
    return out
