"""Is an effect that is small beside a large one its own, or does it mend the large one's shape?

What a shape that is nearly right leaves behind has the direction of the effect itself: the same mixture of the gyro's
axes. What has another direction has another cause.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import chi2

from gsense_fusion.identification.effects.base import parts_of
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.search.selection import RIVAL_LOGLIK, Selection
from gsense_fusion.identification.types import FloatArray, IntArray, Owner
from gsense_fusion.identification.verdict.force_delay import force_delay

OWN_ALPHA = 1e-4
OWN_PART = 0.2
"""Of its gain that must lie in another direction: a mounting that is off by a degree turns less than a thousandth."""
SPANNED = 0.03
"""Singular value over the largest under which directions are one: they are known to some per cent."""
DELAY_AGREES = 0.35
"""Of a delay: by how much the one that G f alone shows may differ from it, beside three standard errors."""


def of_its_own(selection: Selection, best: Fit, name: str, large: str) -> bool:
    """Whether a small effect of the best model has another owner and another direction than the largest one.

    Args:
        selection: The search that found the model.
        best: The model.
        name: The small effect.
        large: The largest effect of the motion.

    """
    effects = selection.effects
    if effects[name].owner is effects[large].owner or large not in best.names:
        return False
    if name == "time_offset":
        return delays_the_force(selection, best)
    gain = _elsewhere(selection.likelihood, best, name, _directions(selection.likelihood, best, large))
    return gain > max(RIVAL_LOGLIK, OWN_PART * selection.gain(best, name)[0])


def delays_the_force(selection: Selection, best: Fit) -> bool:
    """Whether G f by itself is as late as the whole gyro: a shape that lags has no part in that.

    The delay of G f alone is what jerk_coupling finds beside undelayed columns: -tau G times the jerk.
    """
    shown = frozenset({"jerk_coupling"})
    if not shown <= selection.effects.keys() or shown <= best.names or "g_sensitivity" not in best.names:
        return False
    fit = selection.rough((best.names - selection.with_dependants(best.names, "time_offset")) | shown).fit
    found = force_delay(selection.likelihood, fit, "jerk_coupling")
    if found is None:
        return False
    whole = best.templates.gyro_delay_s
    agrees = abs(found.value - whole) < DELAY_AGREES * abs(whole) + 3.0 / np.sqrt(found.information)
    return agrees and float(chi2.sf(found.value**2 * found.information, 1)) < OWN_ALPHA


def _directions(likelihood: Likelihood, fit: Fit, name: str) -> FloatArray:
    """Orthonormal directions in the sensor's axes in which an effect with its further terms acts, shape (3, m).

    A true turn is given in the rail's axes: it has one direction in each mounting.
    """
    vectors = []
    for effect in parts_of(likelihood.effects, name, fit.names):
        beta = fit.beta[likelihood.columns.index(frozenset({effect.name}))].reshape(-1, 3)
        sizes = np.linalg.norm(beta, axis=1)
        parts = [b / s for b, s in zip(beta, sizes, strict=True) if s > 0.0]
        if effect.owner is Owner.RIG:
            parts = [m @ b for b in parts for m in _mountings(likelihood)]
        vectors += parts
    return _spanned(np.array(vectors).T) if vectors else np.zeros((3, 0))


def _spanned(vectors: FloatArray) -> FloatArray:
    """Orthonormal directions (3, m) of some vectors (3, n)."""
    left, values, _ = np.linalg.svd(vectors)
    return np.asarray(left[:, : int(np.sum(values > SPANNED * values.max(initial=0.0)))])


def _mountings(likelihood: Likelihood) -> list[FloatArray]:
    """Rail to sensor of each mounting in which the carriage moved."""
    known = {
        r.mounting_number: r.mounting.sensor_from_rail
        for r in likelihood.campaign.fit
        if r.mounting is not None and any(w.moving for w in r.windows)
    }
    return [m for m in known.values() if m is not None]


def _elsewhere(likelihood: Likelihood, fit: Fit, name: str, directions: FloatArray) -> float:
    """Twice the log-likelihood that an effect loses where it may act in the directions (3, m) only; zero by chance."""
    index = likelihood.columns.index(frozenset({name}))
    if not len(index):
        return 0.0
    effect = next(e for e in likelihood.effects if e.name == name)
    turns = _mountings(likelihood) if effect.owner is Owner.RIG else []
    if turns:  # what mends a shape of the sensor's lies along another direction of the rail's axes in each mounting
        directions = _spanned(np.hstack([turn.T @ directions for turn in turns]))
    if directions.shape[1] >= 3:
        return 0.0
    allowed = np.kron(np.eye(len(index) // 3), directions)
    values, vectors = np.linalg.eigh(fit.covariance[np.ix_(index, index)] / _scale(likelihood, index))
    white = (vectors / np.sqrt(np.maximum(values, 1e-12))).T / likelihood.columns.plausible[index]
    X, y = white @ allowed, white @ fit.beta[index]
    rest = y - X @ np.linalg.lstsq(X, y, rcond=1e-9)[0]
    gain = float(rest @ rest)
    return gain if chi2.sf(gain, len(index) - X.shape[1]) < OWN_ALPHA else 0.0


def _scale(likelihood: Likelihood, index: IntArray) -> FloatArray:
    unit = likelihood.columns.plausible[index]
    return np.asarray(unit[:, None] * unit[None])
