"""The distance between two estimates of the same parameters, each of which sees only some directions of them.

A mounting shows one column of G: along a direction that another session's mounting repeats to a degree or so. What a
direction leaves open is the same unknown in both sessions, if nothing changed. So the directions that each report
identifies are taken as measurements of one set of parameters with their plausible sizes as prior, and the question is
how well the new ones agree with what the old ones say of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from gsense_fusion.identification.result import Covariance
from gsense_fusion.identification.types import BoolArray, FloatArray

IDENTIFIED_VARIANCE = 0.5
"""Of a direction, in plausible sizes; above, an estimate says nothing (its error in `identified.solve` is one)."""


@dataclass(frozen=True, eq=False)
class Contrast:
    """New against old."""

    statistic: float
    """Chi-square of what the new report identifies, given the old one."""
    dof: int
    difference: FloatArray
    """New less old, shape (p,)."""
    covariance: FloatArray
    """Of the difference if nothing changed, shape (p, p)."""
    known: BoolArray
    """Parameters that both reports identify, shape (p,)."""

    @property
    def p_value(self) -> float:
        """Chance of so much if nothing changed."""
        return float(chi2.sf(self.statistic, self.dof)) if self.dof else 1.0

    @property
    def stderr(self) -> FloatArray:
        """Of each difference."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def contrast(old: FloatArray, new: FloatArray, before: Covariance, after: Covariance) -> Contrast:
    """Compare two estimates (p,) of the same parameters in the same order."""
    unit = before.plausible
    e1, s1 = _directions(before, unit)
    e2, s2 = _directions(after, unit)
    r1, r2 = e1.T @ (old / unit), e2.T @ (new / unit)
    gain = np.linalg.solve(np.eye(len(r1)) + s1, (e2.T @ e1).T).T  # the prior is the unit matrix in these units
    expected = gain @ r1
    spread = np.eye(len(r2)) + s2 - gain @ (e1.T @ e2)
    left = r2 - expected
    statistic = float(left @ np.linalg.solve(spread, left)) if len(left) else 0.0
    p1, p2 = e1 @ e1.T, e2 @ e2.T
    turned = (p2 - p1) @ (p2 - p1).T
    covariance = (turned + e1 @ s1 @ e1.T + e2 @ s2 @ e2.T) * np.outer(unit, unit)
    known = np.minimum(np.diag(p1), np.diag(p2)) > 0.5
    return Contrast(statistic, len(r2) if len(r1) else 0, new - old, covariance, known)


def as_identified(values: FloatArray, c: Covariance) -> FloatArray:
    """Values (p,) without what is expected of directions that are not identified: in each report it is another part."""
    directions, _ = _directions(c, c.plausible)
    whole = directions.shape[1] == len(values)
    return values if whole else np.asarray(c.plausible * (directions @ (directions.T @ (values / c.plausible))))


def _directions(c: Covariance, unit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Directions that are identified (p, k), and the covariance along them (k, k), in plausible sizes."""
    values, vectors = np.linalg.eigh(c.matrix / np.outer(unit, unit))
    good = values < IDENTIFIED_VARIANCE
    return vectors[:, good], np.diag(np.maximum(values[good], 1e-15))
