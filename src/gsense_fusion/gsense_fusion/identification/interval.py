"""What the likelihood leaves open of a searched parameter, side by side: profiles are not always parabolas."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import TemplateSpec
from gsense_fusion.identification.likelihood import Fit, Likelihood

LEAST_DROP = 0.3
LARGEST_DROP = 2.0
"""In the log-likelihood: between these a step is small enough to be interpolated."""
DOUBLINGS = 14
HALVINGS = 5
OUT_DROP = 8.0
"""In the log-likelihood: what loses more is out of the question."""
CELLS = 20


def template_stderr(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> float:
    """Standard error of a searched parameter: root mean square of how far it reaches on either side."""
    if template.gaps:
        return instant(likelihood, fit, template)[1]
    below, above = (reach(likelihood, fit, template, side) for side in (-1, 1))
    return float(np.sqrt((below**2 + above**2) / 2))


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

    def out(distance: float) -> bool:
        there = fit.templates.set(template.field, value + side * distance)
        return fit.loglik - likelihood.evaluate(fit.names, there, fit).loglik > OUT_DROP

    inner, step = 0.0, 0.5 * template.plausible
    for _ in range(DOUBLINGS):
        if step >= room or out(step):
            break
        inner, step = step, 2 * step
    step = min(step, max(room, 0.0))
    for _ in range(HALVINGS):
        half = (inner + step) / 2
        inner, step = (inner, half) if out(half) else (half, step)
    return step


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
        return fit.loglik - likelihood.evaluate(fit.names, there, fit).loglik

    inner, kept, step = 0.0, 0.0, max(0.005 * template.plausible, 1e-3 * abs(value))
    for _ in range(DOUBLINGS):
        if step >= room:
            return max(room, 0.0)
        lost = drop(step)
        if lost > LEAST_DROP:
            break
        inner, kept, step = step, max(lost, 0.0), 2 * step
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
    low, high = np.sqrt([kept, lost])  # a parabola's root is a line
    return float(inner + (step - inner) * (np.sqrt(0.5) - low) / (high - low))
