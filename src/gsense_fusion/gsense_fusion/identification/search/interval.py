"""What the likelihood leaves open of a searched parameter, side by side: profiles are not always parabolas."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from gsense_fusion.identification.effects.base import Effect, TemplateSpec, parts_of
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.types import FloatArray

LEAST_DROP = 0.3
LARGEST_DROP = 2.0
"""In the log-likelihood: between these a step is small enough to be interpolated."""
HALF = 0.5
"""The same that a standard error loses."""
NEAR_DROP = 0.1
LEAST_SEEN = 1e-4
"""The same from which on it tells a parabola's width: above all rounding."""
LARGEST_GROWTH = 64.0
DOUBLINGS = 14
HALVINGS = 5
OUT_DROP = 8.0
"""In the log-likelihood: what loses more is out of the question."""
CELLS = 20
"""Of an instant, whose likelihood jumps."""
NODES = 8
"""Of a Gauss-Legendre rule, for a likelihood without jumps."""
LEAST_CURVATURE = 1e-3
"""Of what each searched parameter alone has: together they are at most 30 times as uncertain."""


def template_stderr(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> float:
    """Standard error of a searched parameter: root mean square of how far it reaches on either side."""
    if template.gaps:
        return instant(likelihood, fit, template)[1]
    below, above = (reach(likelihood, fit, template, side) for side in (-1, 1))
    return float(np.sqrt((below**2 + above**2) / 2))


def joint(likelihood: Likelihood, fit: Fit, templates: Sequence[TemplateSpec]) -> FloatArray:
    """Covariance of searched parameters that move together, shape (t, t).

    Well below a resonance only c / f0^2 and c damping / f0 are known: f0 with the damping held fast looks far too well
    known. Of each alone the reach counts, of each pair the mixed second difference of the log-likelihood.
    """
    alone = np.array([template_stderr(likelihood, fit, t) for t in templates])
    value = np.array([fit.templates.get(t.field, t.default) for t in templates])
    room = np.array([min(t.upper - v, v - t.lower) for t, v in zip(templates, value, strict=True)])
    usable = np.isfinite(alone) & (alone > 0.0) & (room > 0.0) & np.array([not t.gaps for t in templates], dtype=bool)
    step = np.where(usable, np.minimum(alone, 0.9 * room), 0.0)

    def loglik(i: int, j: int, a: int, b: int) -> float:
        there = fit.templates.set(templates[i].field, value[i] + a * step[i])
        there = there.set(templates[j].field, value[j] + b * step[j])
        return likelihood.evaluate(fit.names, there, fit, kept=fit.rank).loglik

    curvature = np.eye(len(templates))  # in units of each one's own
    for i, j in itertools.combinations(np.flatnonzero(usable).tolist(), 2):
        mixed = sum(a * b * loglik(i, j, a, b) for a, b in itertools.product((-1, 1), repeat=2)) / 4
        curvature[i, j] = curvature[j, i] = -mixed * alone[i] * alone[j] / (step[i] * step[j])
    values, vectors = np.linalg.eigh(curvature)
    inverse = (vectors / np.maximum(values, LEAST_CURVATURE)) @ vectors.T
    unit = np.where(np.isfinite(alone), alone, [t.upper - t.lower for t in templates])
    grown = unit * np.sqrt(np.maximum(1.0 / np.diag(inverse), 1.0))  # a pair that bends upwards must not narrow it
    return np.asarray(grown[:, None] * inverse * grown[None])


def searched(likelihood: Likelihood, fit: Fit, effect: Effect) -> tuple[FloatArray, FloatArray]:
    """Standard errors of an effect's searched parameters, and what these add to the covariance of the linear ones.

    Returns:
        Standard errors in the order of the templates of its parts, shape (t,), and a covariance of all columns'
        coefficients, shape (P, P).

    """
    key = (fit.names, fit.templates, effect.name)
    if key not in likelihood.searched:
        specs = [t for e in parts_of(likelihood.effects, effect.name, fit.names) for t in e.templates]
        errors: FloatArray = np.zeros(len(specs))
        added: FloatArray = np.zeros((len(fit.beta), len(fit.beta)))
        known = np.array([not _unpaid(fit, t) for t in specs], dtype=bool)
        paid = [t for t, k in zip(specs, known, strict=True) if k]
        errors[known] = np.sqrt(np.diag(joint(likelihood, fit, paid)))
        if effect.name in fit.names:
            added = _carried(likelihood, fit, paid) if paid else added
            for i in np.flatnonzero(~known):
                errors[i], more = _about_default(likelihood, fit, specs[i])
                added = added + more
        likelihood.searched[key] = errors, added
    return likelihood.searched[key]


def _unpaid(fit: Fit, template: TemplateSpec) -> bool:
    return template.optional and fit.templates.get(template.field, template.default) == template.default


def _carried(likelihood: Likelihood, fit: Fit, specs: Sequence[TemplateSpec]) -> FloatArray:
    """Covariance that the uncertainty of searched parameters adds to the coefficients, shape (P, P)."""
    plausible = np.diag([1.0 / t.plausible**2 for t in specs])
    covariance = np.linalg.inv(np.linalg.pinv(joint(likelihood, fit, specs)) + plausible)
    slopes = []
    for t, sigma in zip(specs, np.sqrt(np.diag(covariance)), strict=True):
        value = fit.templates.get(t.field, t.default)
        step = sigma if value + sigma <= t.upper else -min(sigma, value - t.lower)
        moved = likelihood.evaluate(fit.names, fit.templates.set(t.field, value + step), fit, kept=fit.rank)
        slopes.append((moved.beta - fit.beta) / step)
    J = np.array(slopes).T
    return np.asarray(J @ covariance @ J.T)


def _about_default(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> tuple[float, FloatArray]:
    """What is left open of a parameter that was not worth its price, about the default that it has.

    Every value of its range is as likely beforehand: what is not known to be zero is not known to be zero exactly.

    Returns:
        Root mean square of the distance from the default, and what that adds to the covariance of the columns'
        coefficients, shape (P, P).

    """
    low, high = (template.default + side * _edge(likelihood, fit, template, side) for side in (-1, 1))
    node, share = np.polynomial.legendre.leggauss(NODES)
    value = low + (node + 1.0) / 2 * (high - low)
    moved = [likelihood.evaluate(fit.names, fit.templates.set(template.field, float(v)), fit) for v in value]
    loglik = np.array([f.loglik for f in moved])
    weight = share * np.exp(loglik - loglik.max())
    weight /= weight.sum()
    steps = np.array([f.beta - fit.beta for f in moved]).T
    return float(np.sqrt(weight @ (value - template.default) ** 2)), np.asarray((steps * weight) @ steps.T)


def instant(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> tuple[float, float]:
    """Mean and standard deviation of an instant, every one as likely beforehand.

    Not the likeliest one: a gap of minutes between two runs outweighs a second of a run that fits by a hair better.
    """
    value = fit.templates.get(template.field, template.default)
    low, high = value - _edge(likelihood, fit, template, -1), value + _edge(likelihood, fit, template, 1)
    cells = low + (np.arange(CELLS) + 0.5) * (high - low) / CELLS
    loglik = np.array(
        [likelihood.evaluate(fit.names, fit.templates.set(template.field, float(t)), fit).loglik for t in cells]
    )
    weight = np.exp(loglik - loglik.max())
    mean = float(np.average(cells, weights=weight))
    variance = float(np.average((cells - mean) ** 2, weights=weight)) + ((high - low) / CELLS) ** 2 / 12
    return mean, float(np.sqrt(variance))


def _edge(likelihood: Likelihood, fit: Fit, template: TemplateSpec, side: int) -> float:
    """Distance on one side beyond which a parameter is out of the question."""
    value = fit.templates.get(template.field, template.default)
    room = template.upper - value if side > 0 else value - template.lower
    if room <= 0.0:
        return 0.0

    def out(distance: float) -> bool:
        there = fit.templates.set(template.field, value + side * distance)
        return fit.loglik - likelihood.evaluate(fit.names, there, fit).loglik > OUT_DROP

    inner, step = 0.0, 0.5 * template.plausible
    for _ in range(DOUBLINGS):
        if step >= room or out(step):
            break
        inner, step = step, 2 * step
    step = min(step, room)
    for _ in range(HALVINGS):
        half = (inner + step) / 2
        inner, step = (inner, half) if out(half) else (half, step)
    return step


def _growth(lost: float, room: float) -> float:
    """Next step over one that loses little of the log-likelihood: to a parabola's 1/2 where that is within the room."""
    wanted = float(np.sqrt(HALF / lost)) if lost > LEAST_SEEN else 2.0
    return wanted if 2.0 < wanted < min(room, LARGEST_GROWTH) else 2.0


def reach(likelihood: Likelihood, fit: Fit, template: TemplateSpec, side: int) -> float:
    """One standard error of a searched parameter on one side, its own unit.

    Args:
        likelihood: of the data.
        fit: the model at its best value.
        template: the parameter.
        side: -1 below, +1 above.

    Returns:
        The distance that loses 1/2 of the log-likelihood, at most that to the end of the range; infinity where
        nothing is lost as far as is looked.

    """
    value = fit.templates.get(template.field, template.default)
    room = template.upper - value if side > 0 else value - template.lower

    def drop(distance: float) -> float:
        there = fit.templates.set(template.field, value + side * distance)
        return fit.loglik - likelihood.evaluate(fit.names, there, fit, kept=fit.rank).loglik

    inner, kept, step = 0.0, 0.0, max(0.005 * template.plausible, 1e-3 * abs(value))
    for _ in range(DOUBLINGS):
        if step >= room:
            return max(room, 0.0)
        lost = drop(step)
        if lost > LEAST_DROP:
            break
        inner, kept, step = step, max(lost, 0.0), step * _growth(lost, room / step)
    else:
        return float("inf")
    for _ in range(HALVINGS if inner > 0.0 else 0):  # flat, then steep
        if lost <= LARGEST_DROP:
            break
        half = (inner + step) / 2
        there = drop(half)
        if there > LEAST_DROP:
            step, lost = half, there
        else:
            inner, kept = half, max(there, 0.0)
    if abs(lost - HALF) > NEAR_DROP:  # no parabola, of whose shape a place between the two tells more
        half = _between(inner, kept, step, lost)
        there = drop(half)
        if there < HALF:
            inner, kept = half, max(there, 0.0)
        else:
            step, lost = half, there
    return _between(inner, kept, step, lost)


def _between(inner: float, kept: float, step: float, lost: float) -> float:
    """Where 1/2 is lost, from what is lost at two distances on either side: the root of a parabola is a line."""
    low, high = np.sqrt([kept, lost])
    return float(inner + (step - inner) * (np.sqrt(HALF) - low) / (high - low))
