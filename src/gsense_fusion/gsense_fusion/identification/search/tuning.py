"""The searched parameters of a model: tried on their grids, then refined between the points of the grid."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from gsense_fusion.identification.effects.base import Effect, Templates, TemplateSpec
from gsense_fusion.identification.effects.shape import Shape
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.search.interval import OUT_DROP, instant
from gsense_fusion.identification.search.peak import highest, peak, sections
from gsense_fusion.identification.search.screening import instants_about, screened

REFINED_TO = 2e-3
"""Of the way between the neighbours on the grid."""
HOPELESS = 0.1
"""Part of its price that an optional parameter must earn beside the model's drift to get a drift of its own."""
KEPT_POINTS = 3
"""Of an effect's grid, tried when it comes into a larger model: the best ones of the smallest."""

MOST_ROUNDS = 6
FAR_FROM_TOP = 5.0
"""What a round gains in the log-likelihood where it was not the last: a large effect's shapes share a narrow valley."""
FAR_BELOW = 100.0
"""In the log-likelihood: a model this far below the best one is refined no finer than `ROUGHLY_TO`."""
ROUGHLY_TO = 0.02

BESIDE = 0.02
"""Of the way between two points of a grid."""


class Tuning:
    """Values of the searched parameters; what was found for an effect in one model is tried first in the next."""

    def __init__(self, likelihood: Likelihood, rough: Callable[[frozenset[str]], Fit]) -> None:
        """Take the data, and where the fit of a smaller model comes from whose residual says where to begin."""
        self.likelihood = likelihood
        self.effects = {effect.name: effect for effect in likelihood.effects}
        self._rough = rough
        self._screens: dict[tuple[str, frozenset[str]], tuple[float, ...]] = {}
        self._points: dict[str, list[dict[str, float]]] = {}
        self._instants: list[tuple[float, float]] = []
        self._refined: dict[frozenset[str], Templates] = {}
        self._highest = -np.inf

    def specs(self, names: frozenset[str]) -> list[TemplateSpec]:
        """Searched parameters of a set of effects."""
        return [t for n in self.effects if n in names for t in self.effects[n].templates]

    def keep(self, fit: Fit) -> None:
        """Remember the values of a refined model for larger ones."""
        self._refined[fit.names] = fit.templates
        self._highest = max(self._highest, fit.loglik)
        for name in (n for n in fit.names if n in self._points):
            point = _values(fit.templates, self.effects[name].templates)
            self._points[name] = [point, *self._points[name][:KEPT_POINTS]]

    def on_grids(self, names: frozenset[str]) -> Fit:
        """Effects with searched parameters one after the other, each over the product of its grids."""
        fit: Fit | None = None
        for name in (n for n in self.effects if n in names and self.effects[n].templates):
            specs = self.effects[name].templates
            if all(t.optional for t in specs):
                continue
            templates = Templates() if fit is None else fit.templates
            tried = [*self._tried_points(templates, names, name), *_as_it_stood(fit, specs)]
            fit = max(tried, key=lambda f: f.loglik, default=fit)
            known = self._points.get(name, [])
            if fit is None:
                self._points.setdefault(name, [_values(templates, specs)])
            elif self._off_its_points(fit, self.effects[name]):
                fit = self._refine_one(fit, specs[0])
                self._points[name] = [_values(fit.templates, specs), *known[:KEPT_POINTS]]
            else:
                self._points.setdefault(name, [_values(fit.templates, specs)])
        if fit is None:
            return self.likelihood.evaluate(names, Templates())
        return max([fit, *self._beside_refined(names)], key=lambda f: f.loglik)

    def _off_its_points(self, fit: Fit, effect: Effect) -> bool:
        """Whether an effect that exists by one parameter alone may be between the points of its grid."""
        specs, known = effect.templates, self._points.get(effect.name, [])
        if len(specs) != 1 or not specs[0].owns_effect or _values(fit.templates, specs) in known:
            return False
        return not isinstance(effect, Shape) or self._highest - fit.loglik < FAR_BELOW

    def _beside_refined(self, names: frozenset[str]) -> list[Fit]:
        """A further shape over its grid in the refined model without it: shapes of one effect share a valley."""
        found = []
        for effect in (self.effects[n] for n in names if isinstance(self.effects[n], Shape)):
            smaller = names - {effect.name}
            if smaller in self._refined and len(effect.templates) == 1:
                (spec,) = effect.templates
                found += [self._at(names, self._refined[smaller], {spec.field: value}) for value in spec.grid]
        return found

    def _with_columns(self, names: frozenset[str]) -> list[Fit]:
        """A further term in which an effect is linear in the refined model without it: no top of that may be lost."""
        terms = (e for e in self.effects.values() if e.name in names and e.part_of is not None and not e.templates)
        smaller = (names - {term.name} for term in terms)
        return [self._at(names, self._refined[rest], {}) for rest in smaller if rest in self._refined]

    def shown(self, names: frozenset[str]) -> bool:
        """Whether the residual says where to begin with every effect of a set that no fixed grid can cover."""
        wanted = ((n, t) for n, e in self.effects.items() if n in names for t in e.templates if not t.grid)
        return all(self._grid(t, names, n) for n, t in wanted)

    def _tried_points(self, templates: Templates, names: frozenset[str], name: str) -> list[Fit]:
        """An effect at the points of its grid; in a larger model only at those that were best when it came alone."""
        specs = self.effects[name].templates
        screen = any(not t.grid for t in specs)
        if name in self._points and not screen:
            points = self._points[name]
            if specs[0].owns_effect:  # alone, a delay stands for whatever is out of phase: elsewhere it may be small
                points = [*points, *({specs[0].field: value} for value in specs[0].grid)]
            apart = {tuple(point.items()): point for point in points}
            return [self._at(names, templates, point) for point in apart.values()]
        grids = [self._grid(t, names, name) for t in specs]
        points = [dict(zip((t.field for t in specs), p, strict=True)) for p in itertools.product(*grids)]
        tried = sorted((self._at(names, templates, p) for p in points), key=lambda f: -f.loglik)
        if tried and not screen and not specs[0].owns_effect:
            self._points[name] = [_values(f.templates, specs) for f in tried[:KEPT_POINTS]]
        return tried

    def _grid(self, spec: TemplateSpec, names: frozenset[str], name: str) -> Sequence[float]:
        if spec.grid:
            return spec.grid
        rest = frozenset(n for n in names if n != name and name not in self.effects[n].needs)
        key = (spec.field, rest)
        if key not in self._screens:
            self._screens[key] = screened(spec.field, self.likelihood, self._rough(rest))
        return self._screens[key]

    def _at(self, names: frozenset[str], templates: Templates, values: dict[str, float]) -> Fit:
        for field, value in values.items():
            templates = templates.set(field, value)
        return self.likelihood.evaluate(names, templates)

    def refined(self, fit: Fit) -> Fit:
        """Every searched parameter of a fit between the points of its grid, twice at least where there are some."""
        specs = self.specs(fit.names)
        fit = max([fit, *self._with_columns(fit.names)], key=lambda f: f.loglik)
        settled: dict[str, Fit] = {}
        for number in range(1 if len(specs) < 2 else MOST_ROUNDS):
            before = fit.loglik
            fineness = REFINED_TO if self._highest - before < FAR_BELOW else ROUGHLY_TO
            for spec in (s for s in specs if settled.get(s.field) is not fit):
                refined = self._refine_one(fit, spec, fineness)
                threshold = float(np.log(self.likelihood.samples)) if spec.optional else 0.0
                better = 2 * (refined.loglik - fit.loglik) > threshold
                fit = refined if better else fit
                if spec.gaps or not better:  # all instants of the blocks beside it are looked at in one go
                    settled[spec.field] = fit
            gained = fit.loglik - before
            hopeless = gained * (MOST_ROUNDS - 1 - number) < self._highest - fit.loglik - FAR_BELOW
            if hopeless or (number > 0 and gained < FAR_FROM_TOP):
                break
        for spec in (s for s in specs if s.gaps):
            fit = self._at_mean_instant(fit, spec)
        return fit

    def _at_mean_instant(self, fit: Fit, spec: TemplateSpec) -> Fit:
        """A fit at the mean of an instant; one that a smaller model had nearby will do where it fits as well."""
        value = fit.templates.get(spec.field, spec.default)
        for mean in (mean for near, mean in self._instants if abs(near - value) < 2 * spec.plausible):
            moved = self.likelihood.evaluate(fit.names, fit.templates.set(spec.field, mean), fit)
            if fit.loglik - moved.loglik < OUT_DROP:
                return moved
        mean, _ = instant(self.likelihood, fit, spec)
        self._instants.append((value, mean))
        return self.likelihood.evaluate(fit.names, fit.templates.set(spec.field, mean), fit)

    def _refine_one(self, fit: Fit, spec: TemplateSpec, fineness: float = REFINED_TO) -> Fit:
        """A searched parameter between its neighbours on the grid (or its plausible distance)."""

        def evaluate(value: float) -> Fit:
            return self.likelihood.evaluate(fit.names, fit.templates.set(spec.field, value), fit, kept=fit.rank)

        centre = fit.templates.get(spec.field, spec.default)
        if spec.optional:
            centre = max(((evaluate(v).loglik, v) for v in spec.grid), default=(0.0, centre))[1]
        low, high = _between(spec, centre)
        if high <= low:
            return fit
        within = (high - low) * fineness
        if spec.grid:
            best = peak(lambda v: evaluate(v).loglik, centre, low, high, within)
        elif spec.gaps:
            places = instants_about(self.likelihood, centre, spec.plausible / 4)
            best = highest(lambda v: evaluate(v).loglik, places, within)
        else:  # lines beside lines: the highest one need not be the nearest
            best = sections(lambda v: evaluate(v).loglik, low, high, within)
        if spec.optional and 2 * (evaluate(best).loglik - fit.loglik) < HOPELESS * np.log(self.likelihood.samples):
            return fit
        return self.likelihood.evaluate(fit.names, fit.templates.set(spec.field, best), kept=fit.rank)


def _between(spec: TemplateSpec, centre: float) -> tuple[float, float]:
    """The neighbours on the grid of a searched parameter (or its plausible distance), none of them right beside it.

    What a first round left at the end of its way may go on in the next.
    """
    apart = (BESIDE * (b - a) for a, b in itertools.pairwise(spec.grid) if a <= centre <= b)
    beside = max(1e-3 * abs(centre), min(apart, default=0.0))
    below = [g for g in spec.grid if g < centre - beside]
    above = [g for g in spec.grid if g > centre + beside]
    low = max(spec.lower, max(below, default=centre - 2 * spec.plausible))
    return low, min(spec.upper, min(above, default=centre + 2 * spec.plausible))


def _as_it_stood(fit: Fit | None, specs: Sequence[TemplateSpec]) -> list[Fit]:
    """A fit whose values of some searched parameters nobody has set yet: beside a delay they may be the best ones.

    Alone an effect stands for what comes late as well, and so do the points that were kept.
    """
    values = {} if fit is None else _values(fit.templates, specs)
    if fit is None or not all(t.lower <= values[t.field] <= t.upper for t in specs):
        return []
    return [replace(fit, templates=Templates(tuple(sorted({**dict(fit.templates.values), **values}.items()))))]


def _values(templates: Templates, specs: Sequence[TemplateSpec]) -> dict[str, float]:
    return {t.field: templates.get(t.field, t.default) for t in specs}
