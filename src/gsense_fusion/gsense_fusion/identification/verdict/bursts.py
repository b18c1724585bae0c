"""Noise that comes in bursts: its power along the runs in motion scatters more than along the rest.

Over whole cycles of the drive: what the noise does within each of them belongs to the place, the speed or the
acceleration, which have tests of their own. Noise that comes in bursts at rest too is noise.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, rfft
from scipy.stats import f as fisher

from gsense_fusion.identification.types import FloatArray
from gsense_fusion.identification.verdict.fast_part import away_above, fast_part, in_blocks
from gsense_fusion.identification.verdict.residual import WindowResidual
from gsense_fusion.identification.verdict.uneven_noise import Uneven, excess_rms

SHORTEST_S = 1.0
"""Of a block; longer ones until they hold whole cycles."""
LEAST_DEGREES = 20
LARGEST_VARIANCE = 0.25
"""Relative one of a block's power in steady noise: with more its cube root is not normal."""


def bursts(moving: Sequence[WindowResidual], still: Sequence[WindowResidual], highest_hz: float) -> list[Uneven]:
    """The spread of the blocks' power in motion over that at rest, by axis and of all; empty where too few tell."""
    motion, rest = (sum((_spread(w, highest_hz) for w in ws), np.zeros((2, 4))) for ws in (moving, still))
    (square, degrees), (at_rest, known) = motion, rest
    told = (degrees >= LEAST_DEGREES) & (known >= LEAST_DEGREES)
    if not told.any():
        return []
    degrees, known = np.maximum(degrees, 1.0), np.maximum(known, 1.0)
    ratio = (square / degrees) / np.maximum(at_rest / known, 1.0)
    p = np.where(told, fisher.sf(ratio, degrees, known), 1.0)
    axis = int(np.argmax(np.where(told, ratio, 0.0)[:3]))
    window = moving[0]
    excess = np.sqrt(max(ratio[axis] - 1.0, 0.0) * _expected(window, highest_hz)[axis])
    rms = excess_rms(window, away_above(window, highest_hz), axis, float(excess))
    return [Uneven(float(p.min()), axis, rms, "noise in motion that comes in bursts").after(int(told.sum()))]


def _spread(window: WindowResidual, highest_hz: float) -> FloatArray:
    """Squared deviations of the blocks' power in variances of steady noise, and degrees of freedom: by axis, of all.

    Shape (2, 4). Wilson and Hilferty (1931): the cube root of a power is nearly normal.
    """
    power = in_blocks(fast_part(window, highest_hz) ** 2, _length(window))
    expected = _expected(window, highest_hz)
    there = (expected > 0.0) & (expected <= LARGEST_VARIANCE)
    root = np.cbrt(power / np.maximum(power.mean(axis=0), 1e-30))
    square = 9.0 * np.sum((root - root.mean(axis=0)) ** 2, axis=0) / np.where(there, expected, 1.0)
    both = np.stack([square, np.full(3, len(power) - 1.0)]) * there
    return np.column_stack([both, both.sum(axis=1)])


def _length(window: WindowResidual) -> int:
    """Samples of a block."""
    w = window.angular_frequency
    period = SHORTEST_S if w is None else 2 * np.pi / w
    return max(1, round(window.data.run.rate_hz * period * np.ceil(SHORTEST_S / period)))


def _expected(window: WindowResidual, highest_hz: float) -> FloatArray:
    """Relative variance of the blocks' power about their mean in steady noise, by axis, shape (3,); zero: no blocks.

    Of a normal series of unit variance squares covary as twice the square of its correlation, which the bins that are
    looked at give: without the drive's orders it does not end with the block.
    """
    n, length = len(window.window), _length(window)
    count = n // length
    if count < 2:
        return np.zeros(3)
    looked = np.zeros((n // 2 + 1, 3))
    used = away_above(window, highest_hz)[:, None] & (window.bins.weight > 0)
    looked[np.flatnonzero(window.bins.keep)] = used
    correlation = irfft(looked, n, axis=0)
    correlation /= np.maximum(correlation[0], 1e-30)
    block = np.abs(rfft(np.arange(n) < length)) ** 2 / length**2
    covariance = 2.0 * irfft(rfft(correlation**2, axis=0) * block[:, None], n, axis=0)[: count * length : length]
    pairs = 2.0 * (count - np.arange(count)) / count
    pairs[0] = 1.0
    return np.asarray((count * covariance[0] - pairs @ covariance) / (count - 1) * used.any(axis=0))
