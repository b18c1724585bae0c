"""Broadband noise that grows with the speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import norm

from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.effects.statistical import Explanation, Seen, StatisticalEffect
from gsense_fusion.identification.likelihood import Likelihood
from gsense_fusion.identification.residual import WindowResidual
from gsense_fusion.identification.types import AXES, FloatArray, Owner, Parameter

LOWEST_HZ = 5.0
BLOCK_S = 0.1
SURE = 5.0


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
            power.append(_blocks(_fast_part(w) ** 2, length))
            on = np.full(len(v), float(w.window.moving))
            for name, series in (("v2", v**2), ("v", np.abs(v)), ("a2", a**2), ("on", on)):
                drivers[name].append(_blocks(series[:, None], length)[:, 0])
        P = np.concatenate(power)
        fits = {name: _slope(np.concatenate(x), P) for name, x in drivers.items()}
        best = max(fits, key=lambda n: fits[n][2])
        slope, error, _ = fits["v2"]
        if best != "v2" or float(slope.sum()) < SURE * float(np.linalg.norm(error)):
            return None
        size = np.array([_noise_rms(moving[0], axis) for axis in range(3)])
        s = np.sqrt(np.maximum(slope, 0.0)) * size
        spread = np.where(s > 0, 0.5 * error * size**2 / np.maximum(s, 1e-30), size * np.sqrt(error))
        parameters = {
            "s": Parameter(float(np.sqrt(np.mean(s**2))), float(np.linalg.norm(spread) / 3), "rad/s at 1 m/s")
        }
        level = 1.0 + float(slope.max()) * max(_mean_v2(likelihood, w) for w in moving)
        z = float(slope.sum() / np.linalg.norm(error))
        axes = tuple(x for i, x in enumerate(AXES) if slope[i] > 3 * error[i])
        return Explanation(parameters, axes, float(norm.sf(z)), tuple(_scaled(likelihood, windows, slope)), 0.0, level)


def _fast_part(residual: WindowResidual) -> FloatArray:
    """Whitened residual above 5 Hz and away from the drive's orders in time, variance one at rest, shape (n, 3)."""
    n = len(residual.window)
    used = residual.away_from_orders() & (residual.frequency >= LOWEST_HZ)
    spectrum = np.zeros((n // 2 + 1, 3), dtype=complex)
    values = (residual.spectrum[0] + 1j * residual.spectrum[1]) * used[:, None]
    spectrum[np.flatnonzero(residual.bins.keep)] = values
    series = np.fft.irfft(spectrum, n, axis=0)
    return np.asarray(series * n / np.sqrt(4.0 * max(int(used.sum()), 1)))


def _blocks(series: FloatArray, length: int) -> FloatArray:
    n = len(series) // length * length
    return np.asarray(series[:n].reshape(-1, length, series.shape[1]).mean(axis=1))


def _slope(driver: FloatArray, power: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Slope of each axis' power on a driver with a common level, its error, and the part of the variance explained."""
    x = driver - driver.mean()
    y = power - power.mean(axis=0)
    xx = float(x @ x)
    if xx <= 0:
        return np.zeros(3), np.ones(3), 0.0
    slope = x @ y / xx
    rest = y - np.outer(x, slope)
    error = np.sqrt(np.sum((x[:, None] * rest) ** 2, axis=0)) / xx  # the power's own variance grows with the driver
    return slope, error, float(1.0 - np.sum(rest**2) / max(np.sum(y**2), 1e-300))


def _noise_rms(residual: WindowResidual, axis: int) -> float:
    """Noise of one sample in the band that was looked at, rad/s."""
    used = (residual.frequency >= LOWEST_HZ) & (residual.bins.weight[:, axis] > 0)
    n = len(residual.window)
    return float(np.sqrt(np.sum(4.0 / residual.bins.weight[used, axis] ** 2)) / n)


def _scaled(likelihood: Likelihood, windows: Sequence[WindowResidual], slope: FloatArray) -> list[WindowResidual]:
    out = []
    for w in windows:
        v2 = _mean_v2(likelihood, w)
        out.append(replace(w, spectrum=w.spectrum / np.sqrt(1.0 + np.maximum(slope, 0.0) * v2)))
    return out


def _mean_v2(likelihood: Likelihood, residual: WindowResidual) -> float:
    velocity = likelihood.source.of(residual.data, Templates()).kinematics.velocity
    return float(np.mean(velocity[residual.window.start : residual.window.stop] ** 2))
