"""How precisely an analysis knows things: what comparing it with another one takes."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.analysis import Analysis
from gsense_fusion.identification.effects.base import Effect, parts_of
from gsense_fusion.identification.effects.friction_pickup import FrictionPickup, InertiaPickup
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.noise.spectrum import periodogram
from gsense_fusion.identification.outcome.unseen import unseen_variance
from gsense_fusion.identification.result import Covariance
from gsense_fusion.identification.search.interval import template_stderr
from gsense_fusion.identification.search.other_tops import carried
from gsense_fusion.identification.types import AXES, FloatArray, Parameter

NOISE_BAND_HZ = (4.0, 20.0)
FEWEST_ORDINATES = 100


def covariances(a: Analysis) -> dict[str, Covariance]:
    """Of every effect of the full model that is reported by the parameters in which it is linear."""
    full = a.claims.full
    known = (a.selection.effects[n] for n in a.selection.claimable() if n in full.names)
    linear = (e for e in known if e.parameters and type(e).report is Effect.report)
    return {e.name: _covariance(a.likelihood, full, e) for e in linear}


def _covariance(likelihood: Likelihood, fit: Fit, effect: Effect, *, refined: bool = True) -> Covariance:
    parts = parts_of(likelihood.effects, effect.name, fit.names)
    index = np.concatenate([likelihood.columns.index(frozenset({e.name})) for e in parts])
    matrix = fit.covariance[np.ix_(index, index)]
    if refined:
        matrix = matrix + carried(likelihood, fit)[np.ix_(index, index)]
    specs = [p for e in parts for p in e.parameters]
    return Covariance(tuple(p.name for p in specs), matrix, np.array([p.plausible for p in specs]))


def fitted_variance(a: Analysis) -> FloatArray:
    """What the likelihood does not know of the variance of each column's coefficient, shape (P,): all of it is G's."""
    return rounding_variance(a) + _unseen(a)


def _unseen(a: Analysis) -> FloatArray:
    full, columns = a.claims.full, a.likelihood.columns
    out = np.zeros(len(full.beta))
    if "g_sensitivity" in full.names:
        index = columns.index(frozenset({"g_sensitivity"}))
        out[index] = unseen_variance(full.beta[index], full.covariance[np.ix_(index, index)], columns.plausible[index])
    return out


def rounding_variance(a: Analysis) -> FloatArray:
    """What a coarse step of the output adds to the variance of each column's coefficient, shape (P,).

    In every run the rounding makes a part of the signal larger or smaller, by an amplitude that its bias and size there
    decide: as if G along the rail were off, anew in each run.
    """
    full = a.claims.full
    out = np.zeros(len(full.beta))
    if a.rounded is None or not a.rounded.coarse.any() or "g_sensitivity" not in full.names:
        return out
    first = a.likelihood.columns.start["g_sensitivity"]
    grams = a.likelihood.fast.grams(full.templates, full.names)
    for data, gram in zip(a.campaign.fit, grams, strict=True):
        acceleration = a.likelihood.source.of(data, full.templates).kinematics.acceleration
        amplitude = float(np.sqrt(2 * np.mean(acceleration**2)))
        if data.mounting is None or data.mounting.along is None or amplitude <= 0.0:
            continue
        for axis in a.likelihood.noise:
            like = np.zeros(len(out))
            like[first + 3 * axis : first + 3 * axis + 3] = data.mounting.along
            out += (full.covariance @ (gram.xx @ like) * a.rounded.follows[axis] / amplitude) ** 2
    return out


def current_variance(a: Analysis) -> FloatArray:
    """What a motor's current, where it is picked up, adds to the variance of G in one mounting, shape (P,).

    The part of it that accelerates the carriage follows the acceleration as G f does, in the direction of the part that
    overcomes friction: how much of it is in G is known from what is plausible alone.
    """
    full, moving = a.claims.full, [r for r in a.campaign.fit if any(w.moving for w in r.windows)]
    out = np.zeros(len(full.beta))
    mountings = {r.mounting_number: r.mounting.along for r in moving if r.mounting is not None}
    (along, *others) = mountings.values() if mountings else (None,)
    undecided = FrictionPickup.name in full.names and InertiaPickup.name not in full.names and not others
    if not undecided or along is None or "g_sensitivity" not in full.names:
        return out
    friction = full.beta[a.likelihood.columns.index(frozenset({FrictionPickup.name}))]
    (inertia,) = InertiaPickup.templates
    first = a.likelihood.columns.start["g_sensitivity"]
    out[first : first + 9] = np.outer(friction * inertia.plausible, along).ravel() ** 2
    return out


def not_found(a: Analysis) -> tuple[dict[str, dict[str, Parameter]], dict[str, Covariance]]:
    """What each effect that is not in the full model would come to in it, with its covariance.

    Effects whose shape is searched are left out, but for those that exist by one searched parameter alone (a delay).
    """
    values: dict[str, dict[str, Parameter]] = {}
    spreads: dict[str, Covariance] = {}
    for name in a.selection.claimable():
        effect = a.selection.effects[name]
        names = a.selection.with_parts(a.claims.full.names | {name})
        searched = [t for t in effect.templates if not t.optional]
        if name in a.claims.full.names or not a.selection.allowed(names) or not all(t.owns_effect for t in searched):
            continue
        fit = (a.selection.candidate(names) if searched else a.selection.rough(names)).fit
        if effect.parameters:
            spreads[name] = _covariance(a.likelihood, fit, effect, refined=False)
            values[name] = _linear(a.likelihood, fit, effect)
        for t in searched:
            stderr = template_stderr(a.likelihood, fit, t)
            values.setdefault(name, {})[t.name] = Parameter(fit.templates.get(t.field, t.default), stderr, t.unit)
    return values, spreads


def _linear(likelihood: Likelihood, fit: Fit, effect: Effect) -> dict[str, Parameter]:
    out = {}
    for part in parts_of(likelihood.effects, effect.name, fit.names):
        for i, p in zip(likelihood.columns.index(frozenset({part.name})), part.parameters, strict=True):
            out[p.name] = Parameter(float(fit.beta[i]), float(np.sqrt(fit.covariance[i, i])), p.unit)
    return out


def encoder_delay(a: Analysis) -> Parameter | None:
    """Of the IMU against the encoder; None where no run moves."""
    delay = a.campaign.delay
    return Parameter(delay.value, delay.stderr, "s") if np.isfinite(delay.stderr) else None


def rest_noise(a: Analysis) -> dict[str, Parameter]:
    """Amplitude density of each axis at rest over `NOISE_BAND_HZ` (to 0.4 of the sample rate), rad/s/sqrt(Hz).

    An axis that a coarse step holds at one value shows none.
    """
    low, high = NOISE_BAND_HZ[0], min(NOISE_BAND_HZ[1], 0.4 * a.campaign.rate_hz)
    still = [(r, w) for r in a.campaign.runs for w in r.windows if not w.moving and len(w) >= r.run.rate_hz]
    out = {}
    for axis, model in a.noise.items():
        series = [(r.run.angular_rate[w.start : w.stop, axis], r.run.rate_hz) for r, w in still]
        grams = [periodogram(x, rate_hz) for x, rate_hz in series if np.ptp(x) > 0.0]
        used = [(g.frequency >= low) & (g.frequency <= high) & model.usable(g.frequency, g.frequency[0]) for g in grams]
        power = np.concatenate([np.zeros(0), *(g.power[keep] for g, keep in zip(grams, used, strict=True))])
        if len(power) < FEWEST_ORDINATES:
            continue
        mean, stderr = float(power.mean()), float(power.std(ddof=1) / np.sqrt(len(power)))
        out[AXES[axis]] = Parameter(mean**0.5, 0.5 * stderr / mean**0.5, "(rad/s)/sqrt(Hz)")
    return out
