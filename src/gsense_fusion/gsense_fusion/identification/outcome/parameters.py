"""Parameters of the full model with their errors: declared ones, bias, G."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gsense_fusion.identification.analysis import Analysis
from gsense_fusion.identification.effects.base import Effect, parts_of
from gsense_fusion.identification.errors.predict import Prediction, Predictor, session_biases
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.outcome.precision import current_variance, fitted_variance
from gsense_fusion.identification.search.other_tops import carried, errors_with_tops
from gsense_fusion.identification.types import AXES, FloatArray, Parameter
from gsense_fusion.identification.verdict.left_out import survives


def effect_parameters(
    likelihood: Likelihood, fit: Fit, effect: Effect, more: FloatArray | None = None
) -> dict[str, Parameter]:
    """Linear parameters with their errors (those of the effect's further terms too), then the searched ones.

    `more`: what else adds to the variance of each column's coefficient, shape (P,).
    """
    out = {}
    parts = parts_of(likelihood.effects, effect.name, fit.names)
    errors = errors_with_tops(likelihood, fit, effect)[0]
    variance = np.maximum(np.diag(fit.covariance), 0.0) + np.diag(carried(likelihood, fit))
    variance += 0.0 if more is None else more
    for part in parts:
        first = likelihood.columns.start[part.name]
        for i, parameter in enumerate(part.parameters):
            stderr = float(np.sqrt(variance[first + i]))
            out[parameter.name] = Parameter(float(fit.expected[first + i]), stderr, parameter.unit)
    for template, stderr in zip((t for e in parts for t in e.templates), errors, strict=True):
        value = fit.templates.get(template.field, template.default)
        out[template.name] = Parameter(value, float(stderr), template.unit)
    return effect.report(out)


def rail_direction(a: Analysis) -> tuple[float, float, float] | None:
    """The axis of the sensor that the rail is nearest to: what the effects of odd powers take for their sign."""
    known = [r.mounting.along for r in a.campaign.runs if r.mounting is not None and r.mounting.along is not None]
    if not known:
        return None
    along = known[0] * np.sign(known[0][int(np.argmax(np.abs(known[0])))])
    x, y, z = (float(v) for v in along / np.linalg.norm(along))
    return x, y, z


def declared_parameters(a: Analysis) -> dict[str, dict[str, Parameter]]:
    """Of every effect of the declared model that is in the full one, by name."""
    full = a.claims.full
    out: dict[str, dict[str, Parameter]] = {}
    for name in a.settings.declared:
        if name == "bias":
            values, errors = newest_bias(a, full), _bias_stderr(a, full)
            out[name] = {f"b_{x}": Parameter(values[i], errors[i], "rad/s") for i, x in enumerate(AXES)}
        elif name in a.selection.effects:
            effect, doubt, fitted = a.selection.effects[name], not significant(a, name), fitted_variance(a)
            fits = effect_parameters(a.likelihood, full, effect, fitted)
            whole = effect_parameters(a.likelihood, full, effect, fitted + current_variance(a))
            out[name] = {n: replace(p, in_doubt=doubt, fitted_stderr=fits[n].stderr) for n, p in whole.items()}
    return out


def newest_bias(a: Analysis, fit: Fit) -> tuple[float, float, float]:
    """Of the newest session that was fitted."""
    predictor = Predictor(a.likelihood.effects, a.likelihood.source)
    model = Prediction.of("full", fit)
    biases = session_biases(a.campaign.runs, {r: predictor.without(r, model) for r in a.campaign.runs})
    newest = max(r.run.session for r in a.campaign.fit)
    x, y, z = (float(v) for v in biases[newest])
    return x, y, z


def _bias_stderr(a: Analysis, fit: Fit) -> tuple[float, float, float]:
    out = [0.0, 0.0, 0.0]
    for axis, slow in a.likelihood.slow.items():
        ones = np.ones((len(a.likelihood.blocks), 1))
        K = slow.covariance(fit.drift[axis])
        out[axis] = float(1.0 / np.sqrt((ones.T @ np.linalg.solve(K, ones))[0, 0]))
    return out[0], out[1], out[2]


def g_matrix(a: Analysis) -> tuple[tuple[float, float, float], ...] | None:
    """G where it is significant; one that is not compensates nothing."""
    if not significant(a, "g_sensitivity"):
        return None
    first = a.likelihood.columns.start["g_sensitivity"]
    g = a.claims.full.expected[first : first + 9].reshape(3, 3)
    return tuple((float(r[0]), float(r[1]), float(r[2])) for r in g)


def significant(a: Analysis, name: str) -> bool:
    """Whether an effect of the full model would be a finding if it were not declared.

    A declared one needs no second run in motion that confirms it: where there is none, the criterion decides alone.
    """
    full = a.claims.full
    moving = sum(any(w.moving for w in r.windows) for r in a.campaign.fit)
    confirmed = moving == 1 or (name in full.names and survives(a.selection, full, name))
    return name in full.names and a.selection.supported(full, name) and confirmed
