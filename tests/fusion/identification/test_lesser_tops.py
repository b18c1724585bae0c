"""A smaller model is judged where a larger one found the better values of what both search."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.effects.g_resonance import GResonance, RockingMount
from gsense_fusion.identification.search.lesser_tops import without_lesser_tops
from gsense_fusion.identification.search.selection import Candidate, Selection
from gsense_fusion.identification.search.tuning import Tuning

DECLARED = frozenset({"g_sensitivity"})
EFFECTS = {e.name: e for e in REGRESSED}
COST = 20.0


def _top(templates: Templates, names: frozenset[str], jump: float) -> float:
    """A resonance at 9 Hz is worth 90 more than one at 3 Hz, which a search from below stops at."""
    return (50.0 if abs(templates.get("resonance_hz") - 9.0) < 0.5 else 5.0) + jump * ("bias_jump" in names)


class _Search:
    """A selection whose smaller model stopped at 3 Hz and whose larger one came to 9 Hz."""

    declared = DECLARED
    effects = EFFECTS

    def __init__(self, jump: float) -> None:
        specs = lambda names: [t for n in names for t in EFFECTS[n].templates]  # noqa: E731
        self.jump, self.tuning = jump, SimpleNamespace(specs=specs)
        self.likelihood = SimpleNamespace(evaluate=self._fit)
        small, large = DECLARED | {"g_resonance"}, DECLARED | {"g_resonance", "bias_jump"}
        at = {small: 3.0, large: 9.0, DECLARED | {"bias_jump"}: 3.0, DECLARED: 3.0}
        self.memory = {n: self._scored(self._fit(n, Templates().set("resonance_hz", f))) for n, f in at.items()}

    def _fit(self, names: frozenset[str], templates: Templates) -> Any:
        loglik = _top(templates, names, self.jump) if "g_resonance" in names else 0.0
        return SimpleNamespace(names=names, templates=templates, loglik=loglik)

    def _scored(self, fit: Any) -> Candidate:
        return Candidate(fit, 2 * fit.loglik - COST * len(fit.names - DECLARED))

    def with_dependants(self, _names: frozenset[str], name: str) -> frozenset[str]:
        return frozenset({name})

    def candidate(self, names: frozenset[str]) -> Candidate:
        return self.memory[names]

    def candidate_from(self, there: Any) -> Candidate:
        self.memory[there.names] = self._scored(there)
        return self.memory[there.names]

    def search(self, start: Candidate) -> Candidate:
        return start


@pytest.mark.parametrize(("jump", "found"), [(0.0, {"g_resonance"}), (30.0, {"g_resonance", "bias_jump"})])
def test_an_effect_that_moves_nothing_does_not_stay_for_what_another_is_tuned_by(jump: float, found: set[str]) -> None:
    search = _Search(jump)
    best = without_lesser_tops(cast(Selection, search), search.memory[DECLARED | {"g_resonance", "bias_jump"}])
    assert best.fit.names == DECLARED | found


def test_a_further_term_does_not_lead_to_a_lower_top() -> None:
    """The term was first tried where its grid stood best; without it the mode has been found elsewhere since."""

    def evaluate(names: frozenset[str], templates: Templates, _start: object = None, **_kept: int) -> Any:
        f0 = templates.get("resonance_hz")
        loglik = max(100.0 - 50.0 * (f0 - 13.3) ** 2, 90.0 - 50.0 * (f0 - 18.7) ** 2)
        return SimpleNamespace(names=names, templates=templates, loglik=loglik, rank=3)

    def no_rough(_names: frozenset[str]) -> Any:
        raise AssertionError

    likelihood: Any = SimpleNamespace(effects=(GResonance(), RockingMount()), evaluate=evaluate, samples=10_000)
    tuning, mode = Tuning(likelihood, no_rough), Templates().set("resonance_damping", 0.1)
    tuning.keep(evaluate(frozenset({"g_resonance"}), mode.set("resonance_hz", 13.3)))
    both = frozenset({"g_resonance", "g_resonance_rate"})
    found = tuning.refined(evaluate(both, mode.set("resonance_hz", 18.7)))
    assert found.names == both
    assert found.templates.get("resonance_hz") == pytest.approx(13.3, abs=0.1)
