"""A delay of G f alone: to first order -tau G times the jerk, one number where a coupling to the jerk has three."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.search.selection import RIVAL_LOGLIK
from gsense_fusion.identification.types import FloatArray

LIKE_THE_JERK = ("jerk_coupling", "belt_tilt")
LONGEST_S = 0.05
"""A longer delay is not of first order at 8 rad/s."""


@dataclass(frozen=True)
class ForceDelay:
    """The delay of G f whose first order comes nearest to a coupling to the jerk."""

    value: float
    """s."""
    information: float
    """Of the value, 1/s^2."""
    misfit: float
    """Chi-square with two degrees of freedom of the coupling against this delay's."""


def force_delay(likelihood: Likelihood, fit: Fit, name: str) -> ForceDelay | None:
    """Of an effect of a fit that acts with the jerk; None where the fit has no G, or its column along the rail is zero.

    What turns with the rail is compared in the first mounting's axes.
    """
    columns = likelihood.columns
    index = columns.index(frozenset({name}))
    mounting = next((r.mounting for r in likelihood.campaign.fit if r.mounting and r.mounting.along is not None), None)
    if mounting is None or mounting.along is None or "g_sensitivity" not in fit.names or len(index) != 3:
        return None
    G = fit.beta[columns.index(frozenset({"g_sensitivity"}))].reshape(3, 3)
    g = G @ mounting.along
    if name == "belt_tilt" and mounting.sensor_from_rail is not None:
        g = g @ mounting.sensor_from_rail
    else:  # the odd effects take the rail's direction with its largest component positive
        g = g * np.sign(mounting.along[int(np.argmax(np.abs(mounting.along)))])
    weight = _inverse(fit.covariance[np.ix_(index, index)], columns.plausible[index])
    c = fit.beta[index]
    information = float(g @ weight @ g)
    if information <= 0.0:
        return None
    delay = -float(g @ weight @ c) / information
    rest = c + delay * g
    return ForceDelay(delay, information, float(rest @ weight @ rest))


def delay_is_a_rival(likelihood: Likelihood, fit: Fit, name: str) -> bool:
    """Whether what acts with the jerk may be a delay of G f alone, beside effects that are not delayed.

    `time_offset` delays all that the gyro shows; a pick-up in the sensor's own supply need not come late with it.
    """
    if name not in LIKE_THE_JERK or "time_offset" in fit.names or not _can_be_late(likelihood, name):
        return False
    found = force_delay(likelihood, fit, name)
    return found is not None and abs(found.value) < LONGEST_S and found.misfit < RIVAL_LOGLIK


def _can_be_late(likelihood: Likelihood, name: str) -> bool:
    """A tilt of the rig is told from what turns with the sensor where the board was turned."""
    if not any(e.name == "time_offset" for e in likelihood.effects):
        return False
    moved = {r.mounting_number for r in likelihood.campaign.fit if r.mounting and r.mounting.along is not None}
    return name == "jerk_coupling" or len(moved) == 1


def _inverse(covariance: FloatArray, unit: FloatArray) -> FloatArray:
    scale = unit[:, None] * unit
    return np.asarray(np.linalg.inv(covariance / scale) / scale)
