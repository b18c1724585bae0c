"""Does the bias wander more in motion than the rest records predict?

A random walk that runs at all times is the sensor's own and no finding; one that runs only while the carriage moves is
an effect. Both, and a bias that is set anew in every run, are covariances of the block means: the likelihoods of the
three are compared, and sessions of ordinary drift say what the comparison yields by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gsense_fusion.identification.campaign import Campaign
from gsense_fusion.identification.kept import once_for
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.likelihood.slow import WALK_SCALE, Blocks, Drift, GridPoint
from gsense_fusion.identification.search.alternatives import known_columns, slow_residual
from gsense_fusion.identification.search.chance import Chance, profiled, sessions_of_drift
from gsense_fusion.identification.search.selection import RIVAL_LOGLIK
from gsense_fusion.identification.types import FloatArray

MIN_BLOCKS = 6
"""At rest and in motion each."""
FINE = 31
"""Strengths that are tried around the best one."""
WANDERS_SIGMA = 3.0
"""Standard errors from which on the strength of the walk is no accident of the flicker."""
OFFSET_SCALE = 0.3
"""Variances of a bias set anew are tried at this times the flicker strengths."""


@dataclass(frozen=True, eq=False)
class MotionDrift:
    """What a random walk in motion alone gains over drift at all times."""

    chance: Chance
    measure: Callable[[], tuple[float, float]]
    """Likeliest strength of the walk and its standard error; called where they are asked for."""

    @cached_property
    def strength(self) -> tuple[float, float]:
        """Likeliest strength of the walk and its standard error, rad/s/sqrt(s)."""
        return self.measure()

    @property
    def q(self) -> float:
        """Likeliest strength of the walk, rad/s/sqrt(s)."""
        return self.strength[0]

    @property
    def q_stderr(self) -> float:
        """Its standard error."""
        return self.strength[1]

    @property
    def gain(self) -> float:
        """In twice the log-likelihood."""
        return float(self.chance.gains[0])


def motion_drift(likelihood: Likelihood, fit: Fit) -> MotionDrift | None:
    """Compare the kinds of drift beside a model; None where rest or motion is too rare."""
    moving = np.array([w.moving for _, w in likelihood.cuts])
    if min(int(moving.sum()), int((~moving).sum())) < MIN_BLOCKS:
        return None
    residual, known = slow_residual(likelihood, fit), known_columns(likelihood, fit)
    kinds = _hypotheses(likelihood)

    def gains(batch: Mapping[int, FloatArray]) -> FloatArray:
        ordinary = np.maximum(_logliks(kinds.always, batch, known), _logliks(kinds.anew, batch, known))
        return np.asarray(2 * (_logliks(kinds.motion, batch, known) - ordinary))

    own = gains({axis: residual[:, axis, None] for axis in likelihood.slow})
    return MotionDrift(
        Chance(own, lambda: gains(sessions_of_drift(likelihood.slow, residual, known))),
        lambda: _strength(likelihood, kinds.motion, residual, known),
    )


def too_little_rest(likelihood: Likelihood, fit: Fit) -> str | None:
    """Why rest does not tell whether the bias wanders in motion alone; None where it does or nothing wanders."""
    moving = np.array([w.moving for _, w in likelihood.cuts], dtype=bool)
    if int(moving.sum()) < MIN_BLOCKS:
        return None
    rest = float(np.sum(likelihood.blocks.duration[~moving]))
    found = motion_drift(likelihood, fit)
    if found is None:
        return f"{rest:.0f} s of rest say too little of the sensor's own drift"
    if found.q < WANDERS_SIGMA * found.q_stderr or found.gain < -RIVAL_LOGLIK:
        return None
    return (
        f"the bias wanders by {np.degrees(found.q):.2g} deg/s/sqrt(s) in motion, and {rest:.0f} s of rest do not tell "
        "whether it does so at rest too"
    )


@dataclass(frozen=True, eq=False)
class _Hypotheses:
    """Kinds of drift beside flicker: by axis at every pair of strengths."""

    always: Mapping[int, Sequence[GridPoint]]
    motion: Mapping[int, Sequence[GridPoint]]
    anew: Mapping[int, Sequence[GridPoint]]


def _walk_of(likelihood: Likelihood) -> FloatArray:
    return motion_walk(likelihood.blocks, motion_clock(likelihood.campaign, likelihood.blocks.time))


@once_for
def _hypotheses(likelihood: Likelihood) -> _Hypotheses:
    walk = _walk_of(likelihood)
    run = likelihood.blocks.run
    offset = (run[:, None] == run[None]).astype(float)
    return _Hypotheses(
        {axis: s.grid for axis, s in likelihood.slow.items()},
        {axis: s.grid_of(walk, WALK_SCALE) for axis, s in likelihood.slow.items()},
        {axis: s.grid_of(offset, OFFSET_SCALE) for axis, s in likelihood.slow.items()},
    )


def _logliks(
    points: Mapping[int, Sequence[GridPoint]], batch: Mapping[int, FloatArray], known: FloatArray
) -> FloatArray:
    """Highest log-likelihood of sessions (b, n) by axis, shape (n,)."""
    return np.max(_over_grid(points, batch, known), axis=0)


def _over_grid(
    points: Mapping[int, Sequence[GridPoint]], batch: Mapping[int, FloatArray], known: FloatArray
) -> FloatArray:
    """Log-likelihood of sessions (b, n) by axis at every point, all axes at the same, shape (points, n)."""
    total: FloatArray = np.zeros((1, 1))
    for axis, own in points.items():
        pairs = zip(profiled(own, known), own, strict=True)
        quad = [np.sum(batch[axis] * (projector @ batch[axis]), axis=0) + p.logdet for projector, p in pairs]
        total = total - 0.5 * np.array(quad)
    return total


def motion_clock(campaign: Campaign, time: FloatArray) -> FloatArray:
    """How long the carriage had been moving in all runs, held out or not, at some times, s, shape (n,)."""
    intervals = [r.motion.moving for r in campaign.runs if r.motion is not None and r.motion.moving is not None]
    return np.asarray(sum((np.clip(time - i.start, 0.0, i.duration) for i in intervals), np.zeros(len(time))))


def motion_walk(blocks: Blocks, clock: FloatArray) -> FloatArray:
    """Covariance of a random walk of unit strength that runs with a clock (b,) in s; each session anew, (b, b)."""
    same = blocks.session[:, None] == blocks.session[None]
    return np.asarray(same * np.minimum(clock[:, None], clock[None]))


def _strength(
    likelihood: Likelihood, points: Mapping[int, Sequence[GridPoint]], residual: FloatArray, known: FloatArray
) -> tuple[float, float]:
    """Strength of the walk in motion and its standard error: a finer grid around the best point, flicker kept."""
    batch = {axis: residual[:, axis, None] for axis in points}
    best = int(np.argmax(_over_grid(points, batch, known)[:, 0]))
    kernel = _walk_of(likelihood)
    factors = np.geomspace(0.03, 30.0, FINE)
    fine: dict[int, list[GridPoint]] = {}
    for axis, slow in likelihood.slow.items():
        drift = points[axis][best].strengths
        fine[axis] = [slow.point(Drift(drift.flicker, drift.walk * x), kernel) for x in factors]
    values = _over_grid(fine, batch, known)[:, 0]
    walk = np.mean([[p.strengths.walk for p in own] for own in fine.values()], axis=0)
    weight = np.exp(values - values.max())
    mean = float(np.sum(weight * np.sqrt(walk)) / weight.sum())
    return mean, float(np.sqrt(np.sum(weight * (np.sqrt(walk) - mean) ** 2) / weight.sum()))
