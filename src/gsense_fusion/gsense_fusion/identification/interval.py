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


def template_stderr(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> float:
    """Standard error of a searched parameter: root mean square of how far it reaches on either side."""
    below, above = (reach(likelihood, fit, template, side) for side in (-1, 1))
    return float(np.sqrt((below**2 + above**2) / 2))


def middle(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> float:
    """The middle between both reaches: where runs lie apart, an instant between them is as likely as any other."""
    below, above = (reach(likelihood, fit, template, side) for side in (-1, 1))
    value = fit.templates.get(template.field, template.default)
    return value + (above - below) / 2 if np.isfinite(above + below) else value


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
