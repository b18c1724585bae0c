"""Which effects: group search forward, backward and by swaps with the Bayesian information criterion."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from gsense_fusion.identification.effects.own_axes import OwnAxis
from gsense_fusion.identification.kept import weakly
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.search.alternatives import remounted_at
from gsense_fusion.identification.search.hopeless import hopeless
from gsense_fusion.identification.search.tuning import Tuning

MAX_EFFECTS = 4
RIVAL_LOGLIK = 10.0
"""Effects within this of twice the log-likelihood cannot be told apart."""
CLOSE = 40.0
"""Candidates whose searched parameters stand on the grid are refined where their score is within this of the best."""
OFF_GRID = 0.1
"""Part of a large effect's gain that a rival may lack where its searched parameters stand on the grid."""
MAX_REFINED = 3
ORDER_WEIGHT = 0.01
"""Of likelihoods that are equal to this the commoner effect (the catalogue's order) is taken."""
CHEAP_COST = 6.5
"""A parameter that only block means tell, or that refines the shape of an effect which is there without it, costs this,
not ln n of all samples: false alarms of 2e-4 with three."""
FAMILY_COST = 10.0
"""Prior odds, in twice their logarithm, against each further effect of one family: two separate faults that happen to
look alike, where one with a shape of its own explains the data nearly as well."""
HANDLED_COST = 1e6
"""The same against a step while the board is in somebody's hand: none is claimed, and the search goes on without."""
MOST_MERGED = 2
"""Effects of a family that one is tried in the place of at once."""


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
        self._place = {name: i for i, name in enumerate(self.effects)}
        self._memory: dict[frozenset[str], Candidate] = {}
        self._rough: dict[frozenset[str], Candidate] = {}
        self.tuning = Tuning(likelihood, weakly(self._rough_fit))
        self.bought: frozenset[str] = frozenset()
        """Further terms that the best model has, of those that have to be bought."""
        self._looked_at = 2 * float(np.log(max(1, len(self.claimable()))))
        """Prior odds against each named effect, in twice their logarithm: it is the best of as many as there are
        (extended criterion of Chen and Chen, Biometrika 95, 2008). An effect of one parameter would else be claimed by
        chance once in some hundred sessions."""
        self._shapes = {n: s for n, e in self.effects.items() if e.family is not None and (s := self.shapes_of(n))}
        self._own_axes = {n: axes for n in self.effects if (axes := self._axes_of(n))}
        self._say = progress or (lambda _text: None)

    def candidate(self, names: frozenset[str]) -> Candidate:
        """The best fit of a set of effects, searched parameters refined."""
        if names not in self._memory:
            self._say("+".join(sorted(names)) or "bias alone")
            rough = self.rough(names)
            self._memory[names] = (
                rough if not self.tuning.specs(names) else self._scored(self.tuning.refined(rough.fit))
            )
            self.tuning.keep(self._memory[names].fit)
        return self._memory[names]

    def candidate_from(self, there: Fit) -> Candidate:
        """The same refined from given values of the searched parameters, and remembered as the best of its effects."""
        self._memory[there.names] = self._scored(self.tuning.refined(there))
        return self._memory[there.names]

    def rough(self, names: frozenset[str]) -> Candidate:
        """The same with searched parameters on their grids."""
        if names in self._memory:
            return self._memory[names]
        if names not in self._rough:
            self._rough[names] = self._scored(self.tuning.on_grids(names))
        return self._rough[names]

    def fitted(self, names: frozenset[str]) -> bool:
        """Whether a set of effects was tried, roughly at least."""
        return names in self._rough or names in self._memory

    def _rough_fit(self, names: frozenset[str]) -> Fit:
        return self.rough(names).fit

    def tried(self) -> list[Candidate]:
        """Every model that was fitted."""
        return list(self._memory.values())

    def search(self, start: Candidate | None = None) -> Candidate:
        """Forward, backward and swap steps until none improves, from the declared model where no other is given."""
        best = self.candidate(self.declared) if start is None else start
        while (step := self._step(best)).score > best.score + 1e-6:
            best = step
        self.bought = frozenset(n for n in best.fit.names if self.effects[n].bought)
        return best

    def _step(self, best: Candidate) -> Candidate:
        """The best model beside one; what is large and off the grid is looked at where all else is worse."""
        sets = [n for n in self._neighbours(best.fit.names) if not hopeless(self, n, best)]
        near = [c for n in sets if self._adds((c := self.rough(n)).fit, best.fit)]
        near.sort(key=lambda c: -c.score)
        near = [c for c in near if c.score > max(near[0].score, best.score) - CLOSE][:MAX_REFINED]
        step = max((self.candidate(c.fit.names) for c in near), key=lambda c: c.score, default=best)
        return step if step.score > best.score + 1e-6 else self._off_grid(best)

    def _off_grid(self, best: Candidate) -> Candidate:
        """One shaped effect in the place of others of its family where its grid alone may make it worse than they are.

        Of a large effect a mode between the grid's points leaves hundreds, which a freer one takes up.
        """
        names = best.fit.names
        near = []
        for other in self._merged(names, [n for n in names if n not in self.declared]):
            gain = 2 * (best.fit.loglik - self.rough(names & other).fit.loglik)
            if other != names and self.allowed(other):
                near += [c] if best.score - (c := self.rough(other)).score < OFF_GRID * gain else []
        near.sort(key=lambda c: -c.score)
        return max((self.candidate(c.fit.names) for c in near[:MAX_REFINED]), key=lambda c: c.score, default=best)

    def _adds(self, larger: Fit, smaller: Fit) -> bool:
        """Whether a model with more effects has more parameters that the data identifies; any other model may."""
        if not larger.names > smaller.names:
            return True
        free = any(not t.optional for t in self.tuning.specs(larger.names - smaller.names))
        return free or larger.rank > smaller.rank

    def _neighbours(self, names: frozenset[str]) -> Iterable[frozenset[str]]:
        free = [n for n in self.effects if n not in names]
        mine = [n for n in names if n not in self.declared]
        sets: list[frozenset[str]] = []
        full = sum(self.effects[n].part_of is None for n in mine) >= MAX_EFFECTS
        room = [n for n in free if not full or self.effects[n].part_of is not None]
        sets += [names | {n} for n in room] + [self.with_parts(names | {n}) for n in room]
        sets += [names | {n} | self._own_axes[n] for n in room if n in self._own_axes]
        for n in mine:
            rest = names - self.with_dependants(names, n)
            sets.append(rest)
            if not self.effects[n].bought:
                others = [rest | {other} for other in free]  # a further term too, of an effect that stays
                sets += others + [self.with_parts(more) for more in others]
                sets += [rest | {other} | self._own_axes[other] for other in free if other in self._own_axes]
        sets += self._merged(names, mine)
        return dict.fromkeys(s for s in sets if self.allowed(s) and s != names)

    def _merged(self, names: frozenset[str], mine: Sequence[str]) -> list[frozenset[str]]:
        """One effect, shaped, in the place of one or more of its family."""
        sets = []
        for other, shapes in self._shapes.items():
            alike = [n for n in mine if self.effects[n].family == self.effects[other].family]
            for count in range(1, min(len(alike), MOST_MERGED) + 1):
                for some in itertools.combinations(alike, count):
                    rest = names.difference(*(self.with_dependants(names, n) for n in some))
                    sets.append(rest | {other} | shapes)
        return sets

    def with_dependants(self, names: frozenset[str], name: str) -> frozenset[str]:
        """An effect of a set and what cannot be there without it."""
        return frozenset(n for n in names if n == name or name in self.effects[n].needs)

    def with_parts(self, names: Iterable[str]) -> frozenset[str]:
        """Effects with their further terms; those that have to be bought where the search did buy them."""
        names = frozenset(names)
        return names | {n for n, e in self.effects.items() if e.part_of in names and (not e.bought or n in self.bought)}

    def shapes_of(self, name: str) -> frozenset[str]:
        """What has to be bought and shapes the columns of an effect, without any of its own."""
        return frozenset(n for n, e in self.effects.items() if e.part_of == name and e.bought and not e.parameters)

    def _axes_of(self, name: str) -> frozenset[str]:
        """The further terms of an effect for the sensor's other axes."""
        return frozenset(n for n, e in self.effects.items() if e.part_of == name and isinstance(e, OwnAxis))

    def claimable(self) -> list[str]:
        """Effects that can be named: not the further terms of others."""
        return [n for n, e in self.effects.items() if e.part_of is None]

    def allowed(self, names: frozenset[str]) -> bool:
        """Whether every effect of the set has what it needs beside it, and a place where its search can begin."""
        return all(need in names for n in names for need in self.effects[n].needs) and self.tuning.shown(names)

    def _scored(self, fit: Fit) -> Candidate:
        dear, cheap = 0, 0
        for name in fit.names:
            effect = self.effects[name]
            paid = sum(not t.optional or fit.templates.get(t.field, t.default) != t.default for t in effect.templates)
            dear, cheap = (dear + paid, cheap) if effect.dynamic and not effect.bought else (dear, cheap + paid)
        log_n = float(np.log(self.likelihood.samples))
        cheap_columns = self._slow_rank(fit) + self._bought_rank(fit)
        cost = (fit.rank - cheap_columns + dear) * log_n + (cheap_columns + cheap) * min(CHEAP_COST, log_n)
        order = sum(ORDER_WEIGHT * self._place[n] + self.effects[n].rarity for n in fit.names)
        order += FAMILY_COST * self._alike(fit.names) + self._looked_at * self._undeclared(fit.names)
        order += HANDLED_COST * self._handled(fit)
        return Candidate(fit, 2 * fit.loglik - cost - order)

    def _handled(self, fit: Fit) -> bool:
        """Whether an instant of the fit lies where the board was mounted anew.

        No data tells a step of the bias there from what gravity does to the gyro along another axis.
        """
        instants = (fit.templates.get(t.field, t.default) for t in self.tuning.specs(fit.names) if t.gaps)
        return any(remounted_at(self.likelihood.blocks, t) for t in instants)

    def _undeclared(self, names: frozenset[str]) -> int:
        """Effects of a set beyond the declared ones, without the further terms of others."""
        return sum(self.effects[n].part_of is None for n in names - self.declared)

    def _alike(self, names: frozenset[str]) -> int:
        """Undeclared effects beyond the first of each family."""
        families = [self.effects[n].family for n in names - self.declared if self.effects[n].family is not None]
        return len(families) - len(set(families))

    def _slow_rank(self, fit: Fit) -> int:
        """Directions that only block means tell, of the effects that are not declared.

        By the rank and not by the number of columns: those of a supply that never moves are none.
        """
        slow = frozenset(n for n in fit.names - self.declared if not self.effects[n].dynamic)
        return max(0, fit.rank - self.rough(fit.names - slow).fit.rank) if slow else 0

    def _bought_rank(self, fit: Fit) -> int:
        """Directions of the further terms that have to be bought, or refine a shape."""
        cheap = (e for n in fit.names if (e := self.effects[n]).bought or e.refines)
        count = sum(len(e.parameters) for e in cheap)
        return min(count, fit.rank)

    def gain(self, best: Fit, name: str) -> tuple[float, int]:
        """Twice the log-likelihood and the parameters lost when an effect (and what needs it) is taken out."""
        dropped = self.with_dependants(best.names, name)
        without = self.candidate(best.names - dropped).fit
        lost = best.rank - without.rank + len([t for t in self.tuning.specs(dropped) if not t.optional])
        return 2 * (best.loglik - without.loglik), max(1, lost)

    def supported(self, best: Fit, name: str) -> bool:
        """Whether the criterion itself wants the effect in the model (then a declared effect counts as significant)."""
        dropped = self.with_dependants(best.names, name)
        return self.candidate(best.names).score > self.candidate(best.names - dropped).score

    def felt_gain(self, best: Fit, name: str) -> float:
        """The part of `gain` that the accelerometer alone contributes."""
        without = self.candidate(best.names - self.with_dependants(best.names, name)).fit
        felt = self.likelihood.felt
        return 2 * (felt.loglik(best) - felt.loglik(without))

    def p_value(self, best: Fit, name: str) -> float:
        """Of the likelihood ratio against the model without the effect."""
        ratio, parameters = self.gain(best, name)
        return float(chi2.sf(max(ratio, 0.0), parameters))

    def alternatives(self, best: Fit, name: str) -> list[str]:
        """Effects that stand in the place of the named one nearly as well.

        By likelihood, however many parameters they have, or by the criterion: what fits a little worse with fewer
        parameters is as likely true.
        """
        out = []
        score = self.candidate(best.names).score
        rest = best.names - self.with_dependants(best.names, name)
        gain = self.gain(best, name)[0]
        for other in self.claimable():
            swapped = self.with_parts(rest | {other})
            if other in best.names or not self.allowed(swapped):
                continue
            if not self.effects[name].dynamic and self.effects[other].dynamic and not self.effects[other].slow:
                continue  # it moves no block means: it cannot stand for what only these show
            shaped = [swapped | self._shapes[other]] if other in self._shapes else []
            if any(self._as_good(names, best, score, gain) for names in (swapped, *shaped)):
                out.append(other)
        return out

    def _as_good(self, names: frozenset[str], best: Fit, score: float, gain: float) -> bool:
        if self._behind(best, score, self.rough(names)) > RIVAL_LOGLIK + max(CLOSE, OFF_GRID * gain):
            return False
        return self._behind(best, score, self.candidate(names)) < RIVAL_LOGLIK

    @staticmethod
    def _behind(best: Fit, score: float, other: Candidate) -> float:
        """By how much a model comes after the best one, in twice the log-likelihood or by the criterion."""
        return min(2 * (best.best_loglik - other.fit.best_loglik), score - other.score)
