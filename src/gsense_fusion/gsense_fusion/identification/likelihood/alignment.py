"""Gyro scale, cross-axis sensitivity and imperfect mounting: why a true rotation is not seen alike in every mounting.

They cannot be fitted on a carriage that hardly turns, but where the rig does turn (a bowed rail) they change what the
gyro shows of it by some per cent, differently in each mounting. The parameters of the rig's rotations may therefore
differ from mounting to mounting by a Gaussian tolerance, which is integrated out; it widens their intervals by what
nobody can know.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dtrtri

from gsense_fusion.identification.likelihood.gram import Gram
from gsense_fusion.identification.types import FloatArray, IntArray

TOLERANCE = 0.04
"""Gyro scale 3 %, cross-axis 2 %, accelerometer cross-axis 2 %, root-summed (InvenSense PS-MPU-6000A-00 rev 3.4)."""


@dataclass(frozen=True)
class Tolerance:
    """Prior variance of each column's difference between mountings; only columns of the rig's rotations have one."""

    columns: IntArray
    """Shape (r,)."""
    variance: FloatArray
    """Shape (r,)."""

    @staticmethod
    def of(square: FloatArray, groups: tuple[IntArray, ...], used: IntArray) -> Tolerance:
        """From expected squares of the coefficients (P,); a vector's components (a group) mix and share its length.

        Expected: with their variance. A component that is not known may be large, and then so is what a mounting that
        is off by a degree makes of it; taken for small, it would be known from those degrees.

        `used`: the columns of the model; others have no tolerance.
        """
        columns: list[int] = []
        variance: list[float] = []
        present = np.zeros(len(square), dtype=bool)
        present[used] = True
        for group in groups:
            size = float(square[group].sum())
            if size > 0 and present[group].all():
                columns.extend(int(c) for c in group)
                variance.extend([TOLERANCE**2 * size] * len(group))
        return Tolerance(np.array(columns, dtype=np.int64), np.array(variance))

    def among(self, index: IntArray) -> Tolerance:
        """The same with the columns counted among those of `index` (k,), which increase."""
        return Tolerance(np.searchsorted(index, self.columns), self.variance)


@dataclass(frozen=True)
class Marginal:
    """Normal equations of one mounting with its difference integrated out."""

    gram: Gram
    logdet: float
    inverse: FloatArray
    """(S^-1 + X'X)^-1 on the tolerance's columns, shape (r, r)."""


def marginalise(gram: Gram, tolerance: Tolerance) -> Marginal:
    """Integrate the difference of one mounting out of its normal equations."""
    r = tolerance.columns
    if len(r) == 0:
        return Marginal(gram, 0.0, np.zeros((0, 0)))
    root = np.sqrt(tolerance.variance)
    cross = gram.xx[r] * root[:, None]
    own = cross[:, r] * root
    own.flat[:: len(r) + 1] += 1.0
    factor = np.linalg.cholesky(own)  # of 1 + sqrt(S) X'X sqrt(S)
    half = dtrtri(factor, lower=True)[0]
    columns, rates = half @ cross, half @ (gram.xy[r] * root)
    reduced = Gram(
        gram.xx - columns.T @ columns, gram.xy - columns.T @ rates, gram.yy - float(rates @ rates), gram.rows
    )
    half = half * root
    return Marginal(reduced, 2.0 * float(np.sum(np.log(np.diag(factor)))), half.T @ half)


def differences(
    grams: Mapping[int, Gram], marginals: Mapping[int, Marginal], tolerance: Tolerance, beta: FloatArray
) -> dict[int, FloatArray]:
    """Posterior mean of each mounting's difference from the common coefficients, shape (P,)."""
    out: dict[int, FloatArray] = {}
    r = tolerance.columns
    for mounting, gram in grams.items():
        delta = np.zeros(len(beta))
        if len(r):
            delta[r] = marginals[mounting].inverse @ (gram.xy[r] - gram.xx[r] @ beta)
        out[mounting] = delta
    return out
