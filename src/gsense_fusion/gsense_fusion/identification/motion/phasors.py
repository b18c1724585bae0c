"""Harmonics of one frequency at many times: powers of one phasor instead of a cosine and a sine for each order.

The normal equations of all their cosines and sines are sums of products, and a product of two harmonics is a sum of
two others: twice as many sums as there are orders make them all.
"""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.types import ComplexArray, FloatArray, IntArray


def phasors(phase: FloatArray, highest: int) -> ComplexArray:
    """exp(i k phase) for k from 1 to `highest`, shape (highest, n), of the phase of the fundamental in rad, (n,)."""
    out = np.empty((highest, len(phase)), dtype=complex)
    out[:1] = np.exp(1j * phase)
    for k in range(1, highest):  # by halves: the error grows with the order's logarithm, not with the order
        np.multiply(out[(k - 1) // 2], out[k // 2], out=out[k])
    return out


def normal_matrix(powers: ComplexArray, orders: IntArray) -> FloatArray:
    """X'X of the columns [1, cos(k phase), sin(k phase)] for the orders k of shape (m,), shape (1 + 2 m, 1 + 2 m).

    Args:
        powers: What `phasors` gives, at least to the highest of the orders.
        orders: Whole orders of at least one.

    """
    m = len(orders)
    sums = np.concatenate([[powers.shape[1]], powers.sum(axis=1), powers @ powers[-1]])  # of exp(i k phase), k to 2 top
    above = sums[orders[:, None] + orders[None]]
    apart = orders[None] - orders[:, None]
    below = sums[np.abs(apart)]
    out = np.empty((1 + 2 * m, 1 + 2 * m))
    cosine, sine = slice(1, 1 + m), slice(1 + m, None)
    out[0] = np.concatenate([[powers.shape[1]], sums.real[orders], sums.imag[orders]])
    out[:, 0] = out[0]
    out[cosine, cosine] = (below.real + above.real) / 2
    out[sine, sine] = (below.real - above.real) / 2
    out[cosine, sine] = (above.imag + np.sign(apart) * below.imag) / 2
    out[sine, cosine] = out[cosine, sine].T
    return out
