"""Does an effect have the same size in every run? What only resembles it scales differently with the drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from gsense_fusion.identification.effects.base import Effect, Templates, TemplateSpec
from gsense_fusion.identification.likelihood.model import Fit, Likelihood

UNEQUAL_ALPHA = 1e-3
UNEQUAL_PART = 0.04
"""Of an effect's energy: what coefficients of its own in every run may explain on top (no shape is perfect)."""
UNEQUAL_TEMPLATE = 0.2
"""The same for an effect whose shape is itself searched."""
TREND_TOLERATED = 0.2
"""By how much an effect's size may change for each e-fold of the speed."""
BEYOND_ALPHA = 0.05
"""Chance that the truth is within what is tolerated."""


@dataclass(frozen=True)
class Trend:
    """An effect whose size follows the speed of the run: c (1 + slope ln v)."""

    slope: float
    """One where the true law has the speed's next power."""
    gain: float
    """Twice the log-likelihood, one degree of freedom."""

    @property
    def holds(self) -> bool:
        """Whether the size stays the same, but for what a filter or a shape that is nearly right makes of it.

        A small effect's slope is known badly: one that is just beyond what is tolerated may have a tolerable truth.
        """
        if float(chi2.sf(self.gain, 1)) > UNEQUAL_ALPHA or abs(self.slope) < TREND_TOLERATED:
            return True
        beyond = 1.0 - TREND_TOLERATED / abs(self.slope)
        return float(chi2.sf(self.gain * beyond**2, 1)) > BEYOND_ALPHA


@dataclass(frozen=True)
class Homogeneity:
    """Gain of letting an effect's coefficients differ from run to run."""

    excess: float
    """Twice the log-likelihood gained beyond what noise alone would gain."""
    energy: float
    """Whitened energy of the effect over all runs."""
    p_value: float
    tolerated: float = UNEQUAL_PART
    trend: Trend | None = None

    @property
    def holds(self) -> bool:
        """Whether the runs agree."""
        if self.trend is not None and not self.trend.holds:
            return False
        return self.p_value > UNEQUAL_ALPHA or self.excess < self.tolerated * self.energy


def homogeneity(likelihood: Likelihood, fit: Fit, effect: Effect) -> Homogeneity:
    """Compare an effect's common parameters with its own in every run, the other effects being kept."""
    own = frozenset(e.name for e in likelihood.effects if effect.name in (e.name, e.part_of) and e.name in fit.names)
    parts = _linear(likelihood, fit, own)
    for template in effect.templates:
        if template.owns_effect:
            parts += _searched(likelihood, fit, template)
    gain = sum(p.gain for p in parts)
    degrees = sum(p.degrees for p in parts)
    energy = sum(p.energy for p in parts)
    searched = any(not t.optional and not t.owns_effect for t in effect.templates)
    tolerated = UNEQUAL_TEMPLATE if searched else UNEQUAL_PART
    p = float(chi2.sf(gain, max(degrees, 1)))
    return Homogeneity(gain - degrees, energy, p, tolerated, _trend(likelihood, fit, own))


@dataclass(frozen=True)
class _Part:
    gain: float
    degrees: int
    energy: float


def _linear(likelihood: Likelihood, fit: Fit, names: frozenset[str]) -> list[_Part]:
    """Each run's own coefficients: one Newton step from the common ones is exact."""
    index = likelihood.columns.index(names)
    if not len(index):
        return []
    unit = likelihood.columns.plausible[index]
    out = []
    for data, gram in zip(likelihood.campaign.fit, likelihood.fast.grams(fit.templates, fit.names), strict=True):
        if not gram.rows:
            continue
        beta = fit.beta_in(data.mounting_number)
        slope = (gram.xy - gram.xx @ beta)[index] * unit
        xx = gram.xx[np.ix_(index, index)]
        values, vectors = np.linalg.eigh(xx * unit[:, None] * unit[None])
        good = values > 1e-9 * max(float(values[-1]), 1e-300)
        gain = float(np.sum((vectors[:, good].T @ slope) ** 2 / values[good]))
        out.append(_Part(gain, int(good.sum()), float(beta[index] @ xx @ beta[index])))
    return out


def _trend(likelihood: Likelihood, fit: Fit, names: frozenset[str]) -> Trend | None:
    """A size that grows or falls with the run's speed: c (1 + g ln v), all other coefficients free beside g.

    What only resembles an effect (a drag that follows v |v|) scales with another power of the speed; one degree of
    freedom sees that long before as many as there are runs do.
    """
    index, own = likelihood.columns.index(fit.names), likelihood.columns.index(names)
    speeds = [_speed(likelihood, number) for number in range(len(likelihood.campaign.fit))]
    grams = likelihood.fast.grams(fit.templates, fit.names)
    used = [
        (np.log(v), g, likelihood.campaign.fit[i].mounting_number)
        for i, (v, g) in enumerate(zip(speeds, grams, strict=True))
        if g.rows and v > 0
    ]
    if not len(own) or len(used) < 3:
        return None
    slope, size, cross = 0.0, 0.0, np.zeros(len(index))
    for z, gram, mounting in used:
        beta = fit.beta_in(mounting)
        part = np.where(np.isin(np.arange(len(beta)), own), beta, 0.0)
        felt = gram.xx @ part
        slope += z * float(part @ gram.xy - felt @ beta)
        size += z**2 * float(part @ felt)
        cross += z * felt[index]
    # the block means and the accelerometer tell the coefficients too: what they leave open of them is free beside g
    left = size - float(cross @ fit.covariance[np.ix_(index, index)] @ cross)
    return Trend(slope / left, slope**2 / left) if left > 1e-6 * max(size, 1e-300) else None


def _speed(likelihood: Likelihood, number: int) -> float:
    """Root mean square velocity of a fit run's windows in motion, m/s; zero where there is none."""
    data = likelihood.campaign.fit[number]
    velocity = likelihood.source.of(data, Templates()).kinematics.velocity
    parts = [velocity[w.start : w.stop] for w in data.windows if w.moving]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2))) if parts else 0.0


def _searched(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> list[_Part]:
    """Each run's own value of a searched parameter, from a parabola through its likelihood."""
    value = fit.templates.get(template.field, template.default)
    step = 0.1 * template.plausible
    points = [fit.templates.set(template.field, value + k * step) for k in (-1, 0, 1)]
    out = []
    for number, data in enumerate(likelihood.campaign.fit):
        beta = fit.beta_in(data.mounting_number)
        grams = [likelihood.fast.grams(point, fit.names)[number] for point in points]
        if not grams[0].rows:
            continue
        low, middle, high = (2 * float(beta @ g.xy) - float(beta @ g.xx @ beta) for g in grams)
        slope, curvature = (high - low) / 2, -(high - 2 * middle + low)
        if curvature > 0:
            out.append(_Part(slope**2 / curvature / 2, 1, curvature / 2 * (value / step) ** 2))
    return out
