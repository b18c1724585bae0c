"""Harmonics of one frequency at many times, exp(i k phase), and the sums that their least squares need.

Where the phase is steady (an equidistant grid) its row is made of pieces that differ by where they begin alone: two
short tables and a product of matrices stand for all exponentials. Elsewhere they are powers of one phasor. The normal
equations of all cosines and sines are sums of products, and a product of two harmonics is a sum of two others: twice
as many sums as there are orders make them all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.types import ComplexArray, FloatArray, IntArray

FEWEST_STEADY = 100
STEADY_RAD = 1e-9
"""Difference of a step of the phase from the mean step under which all are alike."""


@dataclass(frozen=True, eq=False)
class Phasors:
    """The phase of the fundamental at n times."""

    begin: FloatArray
    """Phase at the begin of each piece, rad, shape (pieces,)."""
    within: FloatArray
    """From there on in a piece, rad, shape (length,); a single zero where the phase is not steady."""
    samples: int

    @staticmethod
    def of(phase: FloatArray) -> Phasors:
        """From the phase in rad, shape (n,)."""
        n = len(phase)
        step = (phase[-1] - phase[0]) / (n - 1) if n > 1 else 0.0
        if n < FEWEST_STEADY or np.abs(np.diff(phase) - step).max() > STEADY_RAD:
            return Phasors(phase, np.zeros(1), n)
        length = round(np.sqrt(n))
        return Phasors(phase[::length], step * np.arange(length), n)

    def oscillation(self, size: ComplexArray, orders: IntArray) -> FloatArray:
        """Real part of the sum over k of size[:, k] exp(i orders[k] phase), shape (s, n); size has the shape (s, k)."""
        begun = size[:, None, :] * self._begun(orders).T
        turned = np.exp(1j * orders[:, None] * self.within)
        sums = np.concatenate([begun.real, -begun.imag], axis=2) @ np.concatenate([turned.real, turned.imag])
        return np.asarray(sums.reshape(len(size), -1)[:, : self.samples])

    def sums(self, series: FloatArray, orders: IntArray) -> ComplexArray:
        """Sums of each series (s, n) times exp(i orders[k] phase), shape (s, k)."""
        pieces = np.zeros((len(series), len(self.begin), len(self.within)))
        pieces.reshape(len(series), -1)[:, : self.samples] = series
        turned = np.exp(1j * self.within[:, None] * orders)
        both = pieces @ np.concatenate([turned.real, turned.imag], axis=1)
        inside = both[:, :, : len(orders)] + 1j * both[:, :, len(orders) :]
        return np.asarray(np.einsum("sak,ka->sk", inside, self._begun(orders)))

    def normal_matrix(self, orders: IntArray) -> FloatArray:
        """X'X of the columns [1, cos(k phase), sin(k phase)] for m whole orders k >= 1, shape (1 + 2 m, 1 + 2 m)."""
        m = len(orders)
        sums = self.sums(np.ones((1, self.samples)), np.arange(2 * int(orders.max()) + 1))[0]
        above = sums[orders[:, None] + orders[None]]
        apart = orders[None] - orders[:, None]
        below = sums[np.abs(apart)]
        out = np.empty((1 + 2 * m, 1 + 2 * m))
        cosine, sine = slice(1, 1 + m), slice(1 + m, None)
        out[0] = np.concatenate([[self.samples], sums.real[orders], sums.imag[orders]])
        out[:, 0] = out[0]
        out[cosine, cosine] = (below.real + above.real) / 2
        out[sine, sine] = (below.real - above.real) / 2
        out[cosine, sine] = (above.imag + np.sign(apart) * below.imag) / 2
        out[sine, cosine] = out[cosine, sine].T
        return out

    def _begun(self, orders: IntArray) -> ComplexArray:
        """exp(i k phase) where the pieces begin, shape (k, pieces)."""
        if len(self.within) > 1:
            return np.exp(1j * orders[:, None] * self.begin)
        return powers(self.begin, int(orders.max()))[orders]


def powers(phase: FloatArray, highest: int) -> ComplexArray:
    """exp(i k phase) for k from 0 to `highest`, shape (1 + highest, n), of a phase in rad, (n,)."""
    out = np.empty((1 + highest, len(phase)), dtype=complex)
    out[0] = 1.0
    out[1:2] = np.exp(1j * phase)
    for k in range(2, 1 + highest):  # by halves: the error grows with the order's logarithm, not with the order
        np.multiply(out[k // 2], out[k - k // 2], out=out[k])
    return out


def turning(step: FloatArray, n: int) -> ComplexArray:
    """exp(i step j) for j from 0 to n - 1, shape (k, n), of steps of the phase in rad, (k,)."""
    length = max(1, round(np.sqrt(n)))
    begun = np.exp(1j * step[:, None] * np.arange(0, n, length))
    within = np.exp(1j * step[:, None] * np.arange(length))
    return np.asarray((begun[:, :, None] * within[:, None, :]).reshape(len(step), -1)[:, :n])
