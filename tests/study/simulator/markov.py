"""Sums of first-order Markov processes at any instants: realisations, and exact whitening by a Kalman filter."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def _walk(time: Array, tau: Array, sigma: Array, draws: Array) -> Array:
    n, k = draws.shape
    state = np.zeros(k)
    out = np.zeros(n)
    for i in range(n):
        for j in range(k):
            keep = 0.0 if i == 0 else np.exp(-(time[i] - time[i - 1]) / tau[j])
            state[j] = keep * state[j] + sigma[j] * np.sqrt(1 - keep * keep) * draws[i, j]
            out[i] += state[j]
    return out


def realise(time: Array, tau: tuple[float, ...], sigma: tuple[float, ...], rng: np.random.Generator) -> Array:
    """One realisation of the sum at increasing times (n,)."""
    draws = rng.standard_normal((len(time), len(tau)))
    return np.asarray(_walk(time, np.array(tau), np.array(sigma), draws))


@njit(cache=True)
def _whiten(time: Array, tau: Array, sigma: Array, white_variance: float, columns: Array) -> Array:
    n, p = columns.shape
    k = len(tau)
    P = np.diag(sigma * sigma)
    state = np.zeros((k, p))
    out = np.zeros((n, p))
    for i in range(n):
        if i > 0:
            for a in range(k):
                ka = np.exp(-(time[i] - time[i - 1]) / tau[a])
                for c in range(p):
                    state[a, c] *= ka
                for b in range(k):
                    P[a, b] *= ka * np.exp(-(time[i] - time[i - 1]) / tau[b])
                P[a, a] += sigma[a] ** 2 * (1 - ka * ka)
        row = P.sum(axis=1)
        S = row.sum() + white_variance
        for c in range(p):
            innovation = columns[i, c] - state[:, c].sum()
            out[i, c] = innovation / np.sqrt(S)
            for a in range(k):
                state[a, c] += row[a] / S * innovation
        for a in range(k):
            for b in range(k):
                P[a, b] -= row[a] * row[b] / S
    return out


def whiten(
    time: Array, tau: tuple[float, ...], sigma: tuple[float, ...], white_variance: float, columns: Array
) -> Array:
    """Columns (n, p) as the innovations, of unit variance, that the noise's own Kalman filter would see."""
    return np.asarray(_whiten(time, np.array(tau), np.array(sigma), white_variance, np.ascontiguousarray(columns)))
