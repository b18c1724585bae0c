"""Other tops of the likelihood over a mode's frequency that are nearly as likely as the highest one.

Far above the drive a weak mode shows by the few orders that reach there: between them the likelihood has a top beside
each, and the highest need not be the mode's. An interval about it alone would be sure of the wrong one.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2, norm

from gsense_fusion.identification.effects.base import Effect, Templates, TemplateSpec, parts_of
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.search.interval import searched
from gsense_fusion.identification.search.peak import peak
from gsense_fusion.identification.types import FloatArray

LIKELY_DROP = float(chi2.isf(0.05, 1)) / 2
"""In the log-likelihood: what lies less below the highest top is within a 95 % interval."""
LIKELY_SIGMA = float(norm.isf(0.025))
HOPELESS_DROP = 12.0
"""The same: a point of the grid this far below has no top beside it that reaches the interval."""
FAR_DROP = 100.0
"""The same at the damping of the best fit: none of the grid's makes up for that."""
ROUNDS = 2
REFINED_TO = 0.02
"""Of the way between the neighbours on the grid."""
SAME = 0.02
"""Relative difference of two frequencies at one top."""


def errors_with_tops(likelihood: Likelihood, fit: Fit, effect: Effect) -> tuple[FloatArray, FloatArray]:
    """What `interval.searched` says, with the distance to other tops in it: a 95 % interval reaches them.

    Returns:
        Standard errors in the order of the templates of its parts, shape (t,), and what the searched parameters add to
        the covariance of all columns' coefficients, shape (P, P).

    """
    errors, added = searched(likelihood, fit, effect)
    if effect.name not in fit.names:
        return errors, added
    key = (fit.names, fit.templates, effect.name)
    if key not in likelihood.tops:
        likelihood.tops[key] = other_tops(likelihood, fit, effect)
    specs = [t for e in parts_of(likelihood.effects, effect.name, fit.names) for t in e.templates]
    for top in likelihood.tops[key]:
        moved = np.array([top.templates.get(t.field, t.default) - fit.templates.get(t.field, t.default) for t in specs])
        errors = np.hypot(errors, moved / LIKELY_SIGMA)
        step = (top.beta - fit.beta) / LIKELY_SIGMA
        added = added + np.outer(step, step)
    return errors, added


def carried(likelihood: Likelihood, fit: Fit) -> FloatArray:
    """What the searched parameters of all effects of a fit add to the covariance of its coefficients, shape (P, P).

    Not to those of their own effect alone: what a mode far above the drive does not make, G does.
    """
    known = [e for e in likelihood.effects if e.name in fit.names and e.part_of is None]
    return np.sum([np.zeros_like(fit.covariance), *(errors_with_tops(likelihood, fit, e)[1] for e in known)], axis=0)


def other_tops(likelihood: Likelihood, fit: Fit, effect: Effect) -> list[Fit]:
    """Fits at other tops over the frequencies of an effect's modes, `LIKELY_DROP` at most below the best one.

    Args:
        likelihood: Of the data.
        fit: The model at its best.
        effect: One of the model whose parts have modes (`TemplateSpec.known_to`).

    Returns:
        For each mode the farthest below and the farthest above, where there are any.

    """
    out: list[Fit] = []
    for part in parts_of(likelihood.effects, effect.name, fit.names):
        for mode in (t for t in part.templates if np.isfinite(t.known_to)):
            rest = [t for t in part.templates if t is not mode]
            tops = [_climbed(likelihood, fit, start, mode, rest) for start in _starts(likelihood, fit, mode, rest)]
            likely = [t for t in tops if fit.loglik - t.loglik < LIKELY_DROP]
            here = fit.templates.get(mode.field)
            for side in (-1.0, 1.0):
                beyond = [t for t in likely if side * (t.templates.get(mode.field) - here) > SAME * here]
                out += sorted(beyond, key=lambda t: -abs(t.templates.get(mode.field) - here))[:1]
    return out


def _starts(likelihood: Likelihood, fit: Fit, mode: TemplateSpec, rest: Sequence[TemplateSpec]) -> list[Fit]:
    """The best fit at each point of a mode's grid that may have a likely top beside it."""
    out = []
    for value in mode.grid:
        points = [fit.templates.set(mode.field, value)]
        if fit.loglik - _at(likelihood, fit, points[0]).loglik > FAR_DROP:
            continue
        for t in rest:
            points += [p.set(t.field, v) for p, v in itertools.product(points, t.grid)]
        best = max((_at(likelihood, fit, p) for p in points), key=lambda f: f.loglik)
        if fit.loglik - best.loglik < HOPELESS_DROP:
            out.append(best)
    return out


def _climbed(likelihood: Likelihood, fit: Fit, start: Fit, mode: TemplateSpec, rest: Sequence[TemplateSpec]) -> Fit:
    """The top beside a point of the grid, each parameter between its neighbours there."""
    top = start
    for _, spec in itertools.product(range(ROUNDS), (mode, *rest)):
        centre, low, high = start.templates.get(spec.field), *_neighbours(spec, start.templates.get(spec.field))
        now = top.templates

        def loglik(value: float, spec: TemplateSpec = spec, now: Templates = now) -> float:
            return _at(likelihood, fit, now.set(spec.field, value)).loglik

        moved = _at(likelihood, fit, now.set(spec.field, peak(loglik, centre, low, high, REFINED_TO * (high - low))))
        top = max(top, moved, key=lambda f: f.loglik)
    return top


def _neighbours(spec: TemplateSpec, value: float) -> tuple[float, float]:
    below, above = [g for g in spec.grid if g < value], [g for g in spec.grid if g > value]
    return max(below, default=spec.lower), min(above, default=spec.upper)


def _at(likelihood: Likelihood, fit: Fit, templates: Templates) -> Fit:
    return likelihood.evaluate(fit.names, templates, fit, kept=fit.rank)
