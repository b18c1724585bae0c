"""Simulated motion that stays in its place (a hand, a head, a limb), with a low-cost sensor's errors, truth beside it.

Every size is drawn from a range that datasheets of MEMS sensors (MPU-6050, BNO055, LSM6DS) and the reach of an arm
give; none from a recording that filters are judged by.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
RATE_HZ = 200.0
FINE = 2
"""The motion is made at this many times the rate."""
GRAVITY = 9.80665
REST_S = 6.0


@dataclass(frozen=True, eq=False)
class Handheld:
    """One trial."""

    angular_rate: Array
    """Measured, rad/s, shape (n, 3)."""
    specific_force: Array
    """Measured, m/s^2, shape (n, 3)."""
    orientation: Array
    """True, body -> ENU, (w, x, y, z), shape (n, 4)."""
    moving: NDArray[np.bool_]
    """Shape (n,)."""


def handheld(seed: int, seconds: float = 60.0) -> Handheld:
    """A trial: rest, motion (every other one with pauses), rest; everything random follows `seed`."""
    rng = np.random.default_rng([seed, 41])
    time = np.arange(round(seconds * RATE_HZ * FINE)) / (RATE_HZ * FINE)
    active = _activity(time, rng, pauses=seed % 2 == 1)
    rate = _band(time, rng, _between(rng, 0.05, 0.3), _between(rng, 1.0, 4.0), _between(rng, 0.2, 6.0), 0) * active
    place = _band(time, rng, _between(rng, 0.2, 0.6), _between(rng, 1.0, 5.0), _between(rng, 0.3, 15.0), 2) * active
    step = 1.0 / (RATE_HZ * FINE)
    acceleration = np.gradient(np.gradient(place, step, axis=0), step, axis=0)
    orientation = _integrate(rate, step, Rotation.random(random_state=rng))
    force = orientation.inv().apply(acceleration + np.array([0.0, 0.0, GRAVITY]))
    rows = np.arange(FINE - 1, len(time), FINE)
    # what a sample holds is the mean since the one before
    mean = (_means(rate), _means(force))
    measured = _sensor(rng, *mean)
    return Handheld(*measured, orientation[rows].as_quat()[:, [3, 0, 1, 2]], active[rows, 0] > 0.0)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    """Evenly in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _means(values: Array) -> Array:
    return np.asarray(values.reshape(-1, FINE, 3).mean(axis=1))


def _activity(time: Array, rng: np.random.Generator, *, pauses: bool) -> Array:
    """0 at rest, 1 in motion, a second between, shape (n, 1)."""
    on = (time > REST_S) & (time < time[-1] - 3.0)
    if pauses:
        for start in np.arange(REST_S + 8.0, time[-1], 14.0):
            on &= ~((time > start) & (time < start + rng.uniform(2.0, 6.0)))
    width = round(RATE_HZ * FINE)
    window = np.hanning(width + 2)[1:-1]
    return np.asarray(np.convolve(np.pad(on.astype(float), width), window / window.sum(), "same")[width:-width, None])


def _band(time: Array, rng: np.random.Generator, low: float, high: float, rms: float, integrals: int) -> Array:
    """Gaussian process between two frequencies (Hz) of this rms, then integrated so many times, shape (n, 3)."""
    f = np.fft.rfftfreq(len(time), time[1] - time[0])
    gain = np.where(f > 0, 1.0 / np.sqrt((1 + (low / np.maximum(f, 1e-9)) ** 8) * (1 + (f / high) ** 8)), 0.0)
    spectrum = (rng.normal(size=(len(f), 3)) + 1j * rng.normal(size=(len(f), 3))) * gain[:, None]
    scale = rms / np.sqrt(np.mean(np.fft.irfft(spectrum, len(time), axis=0) ** 2))
    omega = np.maximum(2 * np.pi * f, 1e-9)[:, None]
    return np.asarray(np.fft.irfft(scale * spectrum / (1j * omega) ** integrals, len(time), axis=0))


def _integrate(rate: Array, step: float, start: Rotation) -> Rotation:
    """Attitudes at the ends of intervals of constant rate, by products of doubling length."""
    q = Rotation.from_rotvec(rate * step)
    shift = 1
    while shift < len(rate):
        later = q[:-shift] * q[shift:]
        q = Rotation.concatenate([q[:shift], later])
        shift *= 2
    return start * q


def _sensor(rng: np.random.Generator, rate: Array, force: Array) -> tuple[Array, Array]:
    n, root = len(rate), np.sqrt(RATE_HZ / 2)
    degree = np.pi / 180
    scale = np.eye(3) + rng.normal(size=(3, 3)) * _between(rng, 0.001, 0.01)
    walk = np.cumsum(rng.normal(size=(n, 3)), axis=0) * _between(rng, 3e-4, 3e-3) * degree / np.sqrt(RATE_HZ)
    g = rng.normal(size=(3, 3)) * _between(rng, 0.005, 0.1) * degree / GRAVITY
    gyro = rate @ scale.T + force @ g.T + walk + rng.normal(size=3) * degree
    gyro += rng.normal(size=(n, 3)) * _between(rng, 0.004, 0.02) * degree * root
    tilted = np.eye(3) + rng.normal(size=(3, 3)) * _between(rng, 0.001, 0.01)
    accelerometer = force @ tilted.T + rng.normal(size=3) * _between(rng, 0.01, 0.2)
    accelerometer += rng.normal(size=(n, 3)) * _between(rng, 1e-3, 4e-3) * root
    return gyro, accelerometer
