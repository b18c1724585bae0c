"""The slow alternatives that a session offers: columns of block means that compete with drift and with one another."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.likelihood.slow import Blocks
from gsense_fusion.identification.motion.grouping import SAME_GRAVITY_RAD
from gsense_fusion.identification.search.chance import Chance, chance
from gsense_fusion.identification.types import GRAVITY, FloatArray, IntArray

MIN_STEP_BLOCKS = 8
JUMP = "bias_jump"


@dataclass(frozen=True, eq=False)
class Alternatives:
    """Columns that are tried on every axis."""

    names: tuple[str, ...]
    """Effect of each column, k of them."""
    columns: FloatArray
    """Shape (b, k)."""


def step_places(blocks: Blocks, remounted: bool = True) -> IntArray:
    """Blocks before which the bias may step: not the first of a session; none where there are too few.

    Args:
        blocks: The blocks, in order of time.
        remounted: Also where the board was mounted anew: whatever gravity does to the gyro steps there.

    """
    inner = np.flatnonzero(blocks.session[1:] == blocks.session[:-1]) + 1
    if not remounted:
        inner = inner[blocks.pose[inner] == blocks.pose[inner - 1]]
    return inner if len(inner) >= MIN_STEP_BLOCKS else np.zeros(0, dtype=np.int64)


def remounted_at(blocks: Blocks, instant: float) -> bool:
    """Whether an instant lies between the middles of two neighbouring blocks of different mountings."""
    after = int(np.searchsorted(blocks.time, instant))
    return 0 < after < len(blocks) and bool(blocks.pose[after] != blocks.pose[after - 1])


def steps(blocks: Blocks, remounted: bool = True) -> FloatArray:
    """A column for each place: zero before, one from there to the session's end, shape (b, places)."""
    at = step_places(blocks, remounted)
    after = np.arange(len(blocks))[:, None] >= at[None]
    return np.asarray((after & (blocks.session[:, None] == blocks.session[at][None])).astype(float))


def slow_alternatives(likelihood: Likelihood) -> Alternatives:
    """Steps at every place, and every slow effect at every point of its grid."""
    step = (
        steps(likelihood.blocks, remounted=False)
        if any(e.name == JUMP for e in likelihood.effects)
        else np.zeros((0, 0))
    )
    columns, names = [step.reshape(len(likelihood.blocks), -1)], [JUMP] * step.shape[1]
    for effect in likelihood.effects:
        if effect.dynamic or not effect.slow or effect.name == JUMP:
            continue
        for point in itertools.product(*(t.grid for t in effect.templates)):
            templates = Templates()
            for template, value in zip(effect.templates, point, strict=True):
                templates = templates.set(template.field, value)
            column = _shared_column(likelihood, effect, templates)
            if column is not None:
                columns.append(column[:, None])
                names.append(effect.name)
    return Alternatives(tuple(names), np.concatenate(columns, axis=1))


def _shared_column(likelihood: Likelihood, effect: Effect, templates: Templates) -> FloatArray | None:
    """Block means of the driver of an effect that adds c_axis times it to each axis; None for other effects."""
    means = likelihood.fast.block_means(effect, templates)
    if means.shape[2] != 3 or not np.allclose(means, means[:, :1, :1] * np.eye(3)):
        return None
    return np.asarray(means[:, 0, 0])


def known_columns(likelihood: Likelihood, fit: Fit) -> FloatArray:
    """Columns of a model's own slow effects, shape (b, j)."""
    own = [e for e in likelihood.effects if e.name in fit.names and e.slow and not e.dynamic]
    columns = [_shared_column(likelihood, e, fit.templates) for e in own]
    empty = np.zeros((len(likelihood.blocks), 0))
    return np.concatenate([empty, *(c[:, None] for c in columns if c is not None)], axis=1)


def gravity_columns(likelihood: Likelihood, fit: Fit) -> FloatArray:
    """How gravity differs between the blocks of different mountings, shape (b, j); none where they feel it alike.

    A G that the mountings hardly identify is zero in a fit, and what it makes of gravity steps where the board was
    turned: no evidence of a step of the bias there, or between the first blocks behind.
    """
    if "g_sensitivity" not in fit.names:
        return np.zeros((len(likelihood.blocks), 0))
    felt = [np.zeros(3) if m is None else m.gravity * m.up for m in (r.mounting for r in likelihood.campaign.fit)]
    force = np.array([felt[run] for run in likelihood.blocks.run])
    directions, spread, _ = np.linalg.svd(force - force.mean(axis=0), full_matrices=False)
    return np.asarray(directions[:, spread > SAME_GRAVITY_RAD * GRAVITY * np.sqrt(len(force))])


def slow_residual(likelihood: Likelihood, fit: Fit) -> FloatArray:
    """Block means that a model leaves, rad/s, shape (b, 3)."""
    return np.asarray(likelihood.blocks.rate - likelihood.block_columns(fit.templates, fit.names) @ fit.beta)


def beside(likelihood: Likelihood, fit: Fit, columns: FloatArray, free: FloatArray | None = None) -> Chance:
    """What columns on every axis (b, k) gain beside a model and `free` ones, and what they gain from drift alone."""
    return chance(likelihood.slow, slow_residual(likelihood, fit), columns, _with_free(likelihood, fit, free))


def _with_free(likelihood: Likelihood, fit: Fit, free: FloatArray | None) -> FloatArray:
    known = known_columns(likelihood, fit)
    return known if free is None else np.concatenate([known, free], axis=1)


def motion_offsets(likelihood: Likelihood) -> FloatArray:
    """A column for each run: one while its carriage moves, zero at rest and in other runs, shape (b, runs)."""
    moving = np.array([w.moving for _, w in likelihood.cuts], dtype=bool)
    run = likelihood.blocks.run
    return np.asarray(((run[:, None] == np.unique(run[moving])[None]) & moving[:, None]).astype(float))


def p_beside(likelihood: Likelihood, fit: Fit, name: str, gain: float, free: FloatArray | None = None) -> float:
    """Chance that drift alone makes some slow effect gain as much as an effect beside a model without it.

    Args:
        likelihood: The data.
        fit: The model without the effect.
        name: The effect.
        gain: Its own in twice the log-likelihood, for an effect that is no common column on every axis.
        free: Columns of block means that may have any size, shape (b, j): what they explain is no evidence.

    """
    tried = slow_alternatives(likelihood)
    if not tried.columns.shape[1]:
        return 1.0
    found = beside(likelihood, fit, tried.columns, free)
    own = [g for g, n in zip(found.gains, tried.names, strict=True) if n == name]
    return found.p_value(float(max(own)) if own else gain)
