"""Which effects: group search forward, backward and by swaps with the Bayesian information criterion."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import chi2

from gsense_fusion.identification.effects.base import Effect, Templates, TemplateSpec
from gsense_fusion.identification.likelihood import Fit, Likelihood
from gsense_fusion.identification.types import FloatArray

MAX_EFFECTS = 6
RIVAL_LOGLIK = 10.0
"""Effects within this of twice the log-likelihood cannot be told apart."""
SOUND_SIGMA = 2.6


@dataclass(frozen=True)
class Candidate:
    """A fitted model and its criterion (larger is better)."""

    fit: Fit
    score: float


class Selection:
    """Search over the catalogue on top of the declared effects."""

    def __init__(
        self, likelihood: Likelihood, declared: frozenset[str], progress: Callable[[str], None] | None = None
    ) -> None:
        """Take the data, the declared effects (always in the model) and where to say what is being tried."""
        self.likelihood = likelihood
        self.declared = declared
        self.effects = {effect.name: effect for effect in likelihood.effects}
        self._memory: dict[frozenset[str], Candidate] = {}
        self._say = progress or (lambda _text: None)

    def candidate(self, names: frozenset[str]) -> Candidate:
        """The best fit of a set of effects, templates refined."""
        if names not in self._memory:
            self._say("+".join(sorted(names)) or "bias alone")
            fit = self._refine(names)
            searched = len(self._template_specs(names))
            score = 2 * fit.loglik - fit.bic_cost(searched, self.likelihood.samples)
            self._memory[names] = Candidate(fit, score)
        return self._memory[names]

    def tried(self) -> list[Candidate]:
        """Every model that was fitted."""
        return list(self._memory.values())

    def search(self) -> Candidate:
        """Forward, backward and swap steps until none improves."""
        best = self.candidate(self.declared)
        while True:
            step = max(
                (self.candidate(n) for n in self._neighbours(best.fit.names)), key=lambda c: c.score, default=best
            )
            if step.score <= best.score:
                return best
            best = step

    def _neighbours(self, names: frozenset[str]) -> Iterable[frozenset[str]]:
        free = [n for n in self.effects if n not in names]
        mine = [n for n in names if n not in self.declared]
        if len(mine) < MAX_EFFECTS:
            for n in free:
                if self.allowed(names | {n}):
                    yield names | {n}
        for n in mine:
            if self.allowed(names - {n}):
                yield names - {n}
            for other in free:
                if self.allowed((names - {n}) | {other}):
                    yield (names - {n}) | {other}

    def allowed(self, names: frozenset[str]) -> bool:
        """Whether every effect of the set has what it needs beside it."""
        return all(need in names for n in names for need in self.effects[n].needs)

    def _template_specs(self, names: frozenset[str]) -> list[TemplateSpec]:
        """Searched parameters that a set is charged for (a refinement pays when it leaves its default)."""
        return [t for n in sorted(names) for t in self.effects[n].templates if t.owns_effect]

    def _refine(self, names: frozenset[str]) -> Fit:
        templates = Templates()
        fit = self.likelihood.evaluate(names, templates)
        specs = [t for n in sorted(names) for t in self.effects[n].templates]
        for template in specs:
            refined = self._refine_one(names, fit, template)
            threshold = 0.0 if template.owns_effect else float(np.log(self.likelihood.samples))
            if 2 * (refined.loglik - fit.loglik) > threshold:
                fit = refined
        return fit

    def _refine_one(self, names: frozenset[str], fit: Fit, template: TemplateSpec) -> Fit:
        def evaluate(value: float) -> Fit:
            return self.likelihood.evaluate(names, replace(fit.templates, **{template.field: value}), fit)

        tried = sorted(((evaluate(v).loglik, v) for v in template.grid), reverse=True)
        centre = tried[0][1]
        step = float(np.max(np.diff(template.grid)))
        low, high = max(template.lower, centre - step), min(template.upper, centre + step)
        found = minimize_scalar(
            lambda v: -evaluate(float(v)).loglik,
            bounds=(low, high),
            method="bounded",
            options={"xatol": (high - low) * 1e-3},
        )
        return self.likelihood.evaluate(names, replace(fit.templates, **{template.field: float(found.x)}))

    def gain(self, best: Fit, name: str) -> tuple[float, int]:
        """Twice the log-likelihood and the parameters lost when an effect (and what needs it) is taken out."""
        dropped = frozenset(n for n in best.names if n == name or name in self.effects[n].needs)
        without = self.candidate(best.names - dropped).fit
        lost = (
            best.rank
            - without.rank
            + sum(len([t for t in self.effects[n].templates if t.owns_effect]) for n in dropped)
        )
        return 2 * (best.loglik - without.loglik), max(1, lost)

    def supported(self, best: Fit, name: str) -> bool:
        """Whether the criterion itself wants the effect in the model (then a declared effect counts as significant)."""
        dropped = frozenset(n for n in best.names if n == name or name in self.effects[n].needs)
        return self.candidate(best.names).score > self.candidate(best.names - dropped).score

    def p_value(self, best: Fit, name: str) -> float:
        """Of the likelihood ratio against the model without the effect."""
        ratio, parameters = self.gain(best, name)
        return float(chi2.sf(max(ratio, 0.0), parameters))

    def alternatives(self, best: Fit, name: str) -> list[str]:
        """Effects that, in the place of the named one, explain the data as well, however many parameters they have."""
        out = []
        for other in self.effects:
            swapped = (best.names - {name}) | {other}
            if other in best.names or not self.allowed(swapped):
                continue
            if 2 * (best.best_loglik - self.candidate(swapped).fit.best_loglik) < RIVAL_LOGLIK:
                out.append(other)
        return out


def refinement_variance(likelihood: Likelihood, fit: Fit, effect: Effect) -> FloatArray:
    """What the uncertainty of an effect's refinements (the lag of a temperature) adds to the parameters' variances.

    Returns:
        Variance of each column's coefficient, shape (P,).

    """
    out = np.zeros(len(fit.beta))
    for template in effect.templates:
        if template.owns_effect or effect.name not in fit.names:
            continue
        known = template_stderr(likelihood, fit, template)
        sigma = 1.0 / np.sqrt(1.0 / known**2 + 1.0 / template.plausible**2)
        value = min(float(getattr(fit.templates, template.field)) + sigma, template.upper)
        moved = likelihood.evaluate(fit.names, replace(fit.templates, **{template.field: value}), fit)
        out += (moved.beta - fit.beta) ** 2
    return out


def template_sound(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> bool:
    """Whether a searched parameter is significant and not at the end of its range (a local optimum is no finding)."""
    value = float(getattr(fit.templates, template.field))
    margin = 0.01 * (template.upper - template.lower)
    inside = template.lower + margin < value < template.upper - margin
    return inside and abs(value) > SOUND_SIGMA * template_stderr(likelihood, fit, template)


def template_stderr(likelihood: Likelihood, fit: Fit, template: TemplateSpec) -> float:
    """Standard error of a searched parameter from the curvature of the profile likelihood."""
    value = float(getattr(fit.templates, template.field))
    step = max(1e-4, 0.01 * abs(value))
    for _ in range(12):
        sides = [value - step, value + step]
        drop = [
            fit.loglik - likelihood.evaluate(fit.names, replace(fit.templates, **{template.field: v}), fit).loglik
            for v in sides
        ]
        mean = float(np.mean(drop))
        if mean > 0.3:
            return float(step / np.sqrt(2 * mean))
        step *= 2.0
    return float("inf")
