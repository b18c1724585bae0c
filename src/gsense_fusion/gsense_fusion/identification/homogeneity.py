"""Does an effect have the same size in every run? What only resembles it scales differently with the drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from gsense_fusion.identification.effects.base import Effect, TemplateSpec
from gsense_fusion.identification.likelihood import Fit, Likelihood

UNEQUAL_ALPHA = 1e-3
UNEQUAL_PART = 0.04
"""Of an effect's energy: what coefficients of its own in every run may explain on top (no shape is perfect)."""
UNEQUAL_TEMPLATE = 0.2
"""The same for an effect whose shape is itself searched."""


@dataclass(frozen=True)
class Homogeneity:
    """Gain of letting an effect's coefficients differ from run to run."""

    excess: float
    """Twice the log-likelihood gained beyond what noise alone would gain."""
    energy: float
    """Whitened energy of the effect over all runs."""
    p_value: float
    tolerated: float = UNEQUAL_PART

    @property
    def holds(self) -> bool:
        """Whether the runs agree."""
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
    return Homogeneity(gain - degrees, energy, float(chi2.sf(gain, max(degrees, 1))), tolerated)


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
