"""Noise parameters from rest: overlapping Allan deviation (allantools) and the white, flicker and walk that make it.

Conventions (IEEE Std 952-1997, annex C): avar(tau) = N^2/tau + (2 ln 2/pi) B^2 + K^2 tau/3, N the random walk of the
integral (two-sided density N^2), B the bias instability, K the rate random walk. Datasheets and the bridge mean the
one-sided density D with variance = D^2 bandwidth, so D = sqrt(2) N.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import allantools
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

FloatArray = NDArray[np.float64]
SHORTEST_S = 0.1
"""Below, the sensor's own low-pass bends the curve."""
PARTS = 5
"""The longest averaging time is this part of the record: beyond, the curve is mostly chance."""
PER_DECADE = 8
MIN_REST_S = 30.0


@dataclass(frozen=True)
class AllanCurve:
    """Overlapping Allan deviation of one series."""

    tau: FloatArray
    """s, shape (m,)."""
    deviation: FloatArray
    """In the unit of the series, shape (m,)."""
    stderr: FloatArray
    """Of the deviation, shape (m,)."""


@dataclass(frozen=True)
class NoiseParameters:
    """Of one axis; u is the unit of the series."""

    random_walk: float
    """N, u sqrt(s)."""
    random_walk_stderr: float
    instability: float
    """B, u."""
    rate_random_walk: float
    """K, u/sqrt(s)."""
    curve: AllanCurve

    @property
    def density(self) -> float:
        """One-sided white density D, u/sqrt(Hz)."""
        return float(np.sqrt(2.0) * self.random_walk)

    def model(self, tau: FloatArray) -> FloatArray:
        """Allan deviation that the parameters make, shape (m,)."""
        return np.asarray(np.sqrt(_columns(tau) @ _squares(self)))


def allan_curve(series: FloatArray, rate_hz: float) -> AllanCurve:
    """Overlapping Allan deviation of a series (n,) at rest, from 2 samples to a fifth of its length."""
    longest = len(series) / rate_hz / PARTS
    taus = np.geomspace(2 / rate_hz, longest, max(4, round(PER_DECADE * np.log10(longest * rate_hz / 2))))
    tau, deviation, _, _ = allantools.oadev(series, rate=rate_hz, data_type="freq", taus=taus)
    tau, first = np.unique(tau, return_index=True)
    deviation = deviation[first]
    # degrees of freedom for white noise, Riley, NIST SP 1065, 5.4.1
    m = np.maximum(np.rint(tau * rate_hz), 1.0)
    n = float(len(series) + 1)
    edf = np.maximum((3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m**2 / (4 * m**2 + 5), 1.0)
    return AllanCurve(tau, deviation, deviation / np.sqrt(2 * edf))


def noise_parameters(series: FloatArray, rate_hz: float) -> NoiseParameters:
    """Fit the three kinds of noise to the curve of a series (n,).

    Raises:
        ValueError: less than `MIN_REST_S` of rest.
    """
    if len(series) < MIN_REST_S * rate_hz:
        raise ValueError(
            f"{len(series) / rate_hz:.0f} s of rest: at least {MIN_REST_S:g} s are needed, an hour is better"
        )
    curve = allan_curve(series, rate_hz)
    use = curve.tau >= SHORTEST_S
    tau, variance = curve.tau[use], curve.deviation[use] ** 2
    relative = 2 * curve.stderr[use] / curve.deviation[use]
    A = _columns(tau)
    squares = np.zeros(3)
    weight = 1.0 / (relative * variance)
    for _ in range(4):  # the error follows the curve as it is expected, not as it happened to come
        squares, _rest = nnls(A * weight[:, None], variance * weight)
        weight = 1.0 / (relative * np.maximum(A @ squares, 1e-3 * variance))
    # neighbouring points share data: a decade holds about two independent ones
    scale = PER_DECADE / 2.0
    normal = (A * weight[:, None]).T @ (A * weight[:, None])
    covariance = np.linalg.pinv(normal) * scale
    N = float(np.sqrt(squares[0]))
    stderr = float(np.sqrt(covariance[0, 0]) / (2 * N)) if N > 0 else float(np.sqrt(np.sqrt(covariance[0, 0])))
    return NoiseParameters(N, stderr, float(np.sqrt(squares[1])), float(np.sqrt(squares[2])), curve)


def pooled_density(parameters: Sequence[NoiseParameters]) -> float:
    """One density for a sensor: root mean square over its axes."""
    return float(np.sqrt(np.mean([p.density**2 for p in parameters])))


def _columns(tau: FloatArray) -> FloatArray:
    return np.stack([1 / tau, np.full_like(tau, 2 * np.log(2) / np.pi), tau / 3], axis=1)


def _squares(p: NoiseParameters) -> FloatArray:
    return np.array([p.random_walk**2, p.instability**2, p.rate_random_walk**2])
