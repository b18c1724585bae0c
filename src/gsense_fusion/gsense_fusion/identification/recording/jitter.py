"""Numbering of samples whose stamps jitter by a good part of a period: single steps do not tell what is missing."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import isotonic_regression

from gsense_fusion.identification.types import FloatArray, IntArray

STRONG = 0.08
"""Of a period, standard deviation: from here on, a late sample beside an early one looks like a loss too often."""
STRONGEST = 0.35
"""From here on the phase is lost in noise."""
PROBE = 2000
"""Samples that tell the period."""
OFF = 0.08
"""How far the median step may be off, where jitter meets loss."""
SOON = 25
"""Samples from one on, whose median says what was lost before it: one that only came late is far above it."""
BLOCK = 1000
"""Samples whose mean phase is known well, and within which the clock is steady."""


def strength(periods: FloatArray) -> float:
    """Standard deviation of single stamps in periods, from the steps (n - 1,) in units of their median."""
    return float(1.4826 * np.median(np.abs(periods - 1.0)) / np.sqrt(2.0))


def numbered(periods: FloatArray) -> IntArray:
    """Grid numbers (n,), from zero, of samples with these steps.

    The phase of the stream against its own period does not change where samples are lost, and its mean over many is
    that of the clock. The numbers that lie nearest to the stamps and increase are an isotonic regression.
    """
    time = np.concatenate([[0.0], np.cumsum(periods)])
    time = time / (1.0 + _slow_by(time))
    time -= _phase(time)
    count = np.arange(len(time))
    ahead = time - count
    soon = median_filter(ahead, SOON, origin=-(SOON // 2))
    lacking = np.rint(isotonic_regression(np.minimum(ahead, soon + 0.5)).x).astype(np.int64)
    return np.asarray(count + lacking - lacking[0], dtype=np.int64)


def _slow_by(time: FloatArray) -> float:
    """By which part the true period is longer than one: there the stamps of a stretch agree best in phase."""
    first = max(0, (len(time) - PROBE) // 2)
    probe = time[first : first + PROBE]
    tried = np.arange(-OFF, OFF, 0.25 / len(probe))
    agree = [abs(np.exp(2j * np.pi * probe / (1.0 + slow)).sum()) for slow in tried]
    return float(tried[int(np.argmax(agree))])


def _phase(time: FloatArray) -> FloatArray:
    """Slow phase of the stream in periods, shape (n,)."""
    blocks = np.array_split(np.arange(len(time)), max(1, round(len(time) / BLOCK)))
    turns = np.array([np.angle(np.exp(2j * np.pi * time[b]).mean()) for b in blocks])
    return np.interp(np.arange(len(time)), [float(b.mean()) for b in blocks], np.unwrap(turns) / (2 * np.pi))
