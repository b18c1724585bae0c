"""Least squares in which only some directions of the parameters are identified."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gsense_fusion.identification.likelihood.gram import Gram
from gsense_fusion.identification.types import BoolArray, FloatArray, IntArray

IDENTIFIED_PART = 0.3
KEPT_PART = 1.0
"""The same of a direction that a neighbouring fit identified."""
FELT_IDENTIFIES = 1e-3
"""Information in plausible sizes from which the accelerometer's word identifies a direction: 30 of them."""


class Solution(NamedTuple):
    """Coefficients of k columns."""

    part: FloatArray
    """Zero in the directions that are not identified, shape (k,)."""
    covariance: FloatArray
    """With the plausible size in those, shape (k, k)."""
    rank: int
    """Number of directions that are identified."""
    expected: FloatArray
    """`part` with the posterior mean in those, shape (k,)."""


def solve(gram: Gram, index: IntArray, plausible: FloatArray, felt: Gram | None = None, kept: int = 0) -> Solution:
    """Least squares; directions that the data does not identify get zero with their plausible size as error.

    Parameters are measured in their plausible sizes. A direction counts as identified where its standard error is under
    `IDENTIFIED_PART` of that: from one mounting, G comes out along the direction in which the board was accelerated.
    What is told of the others is too little to state them, but not to predict by: there the expectation is
    the mean of the posterior with the plausible size as the prior's deviation (ridge regression).

    Args:
        gram: Normal equations with unit noise.
        index: Columns to use, shape (k,).
        plausible: Plausible size of every column's parameter, shape (P,).
        felt: The accelerometer's part of `gram`. A direction that it tells about counts as identified where the
            parameter's error is large beside what is plausible: no error of a mounting imitates it.
        kept: Of so many of the best known directions, those count that are known to `KEPT_PART` of what is plausible.

    """
    if len(index) == 0:
        return Solution(np.zeros(0), np.zeros((0, 0)), 0, np.zeros(0))
    unit, right = plausible[index], plausible[index] * gram.xy[index]
    scale = unit[:, None] * unit[None]
    values, vectors = np.linalg.eigh(gram.xx[np.ix_(index, index)] * scale)
    good = _identified(values, kept)
    if felt is not None:
        own = np.sum(vectors * (felt.xx[np.ix_(index, index)] * scale @ vectors), axis=0)
        good |= (own > 0.5 * values) & (values > FELT_IDENTIFIES)
    shown, hidden = vectors[:, good], vectors[:, ~good]
    inverse = (shown / values[good]) @ shown.T
    covariance = (inverse + hidden @ hidden.T) * scale
    part = unit * (inverse @ right)
    shrunk = (hidden.T @ right) / (np.maximum(values[~good], 0.0) + 1.0)
    return Solution(part, covariance, int(good.sum()), part + unit * (hidden @ shrunk))


def _identified(values: FloatArray, kept: int) -> BoolArray:
    """Which directions of so much information (k,), increasing, are known well enough beside what is plausible."""
    best = np.arange(len(values)) >= len(values) - kept
    return np.asarray((values > 1.0 / IDENTIFIED_PART**2) | (best & (values > 1.0 / KEPT_PART**2)))
