"""Which effects are listed beside a named one."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.search import tuning
from gsense_fusion.identification.search.selection import Candidate, Selection

NAMES = ("g_resonance", "belt_tilt", "jerk_coupling", "speed_pickup")


def _selection(fits: dict[str, tuple[float, float]]) -> tuple[Selection, Any]:
    """A search that is over: twice the log-likelihood and the score of each effect alone."""
    effects = [e for e in REGRESSED if e.name in NAMES]
    made = Selection(SimpleNamespace(effects=effects), frozenset())  # type: ignore[arg-type]
    likely = {"": (0.0, 0.0), **fits}
    fit = {
        n: SimpleNamespace(names=frozenset({n} - {""}), rank=0, loglik=double / 2, best_loglik=double / 2)
        for n, (double, _) in likely.items()
    }
    made._memory = {fit[n].names: Candidate(fit[n], score) for n, (_, score) in likely.items()}  # type: ignore[arg-type]
    return made, fit


@pytest.mark.parametrize(("named", "rivals"), [("g_resonance", ["belt_tilt"]), ("belt_tilt", ["g_resonance"])])
def test_what_fits_a_little_worse_with_fewer_parameters_is_a_rival(named: str, rivals: list[str]) -> None:
    """A mode with two searched parameters is 26 likelier than a plain tilt, and its criterion better by two."""
    fits = {"g_resonance": (126.0, 2.0), "belt_tilt": (100.0, 0.0), "jerk_coupling": (70.0, -30.0)}
    selection, fit = _selection({**fits, "speed_pickup": (0.0, -100.0)})
    assert selection.alternatives(fit[named], named) == rivals


def test_what_fits_as_well_with_more_parameters_is_a_rival() -> None:
    fits = {"belt_tilt": (100.0, 0.0), "g_resonance": (95.0, -29.0), "jerk_coupling": (80.0, -20.0)}
    selection, fit = _selection({**fits, "speed_pickup": (0.0, -100.0)})
    assert selection.alternatives(fit["belt_tilt"], "belt_tilt") == ["g_resonance"]


def test_the_bend_of_a_rail_costs_what_a_refinement_does_and_a_swap_brings_it() -> None:
    """A straight twist and a pick-up fit alike: only the bend, which comes with the rail, tells them apart."""
    selection, fit = _selection({"speed_pickup": (0.0, 0.0)})
    selection.effects = {e.name: e for e in REGRESSED if e.name in ("rail_curvature", "rail_bend", "speed_pickup")}
    swapped = frozenset({"rail_curvature", "rail_bend"})
    assert swapped in list(selection._neighbours(fit["speed_pickup"].names))
    assert selection._bought_rank(SimpleNamespace(names=swapped, rank=6)) == 3  # type: ignore[arg-type]
    alone = SimpleNamespace(names=frozenset({"rail_curvature"}), rank=6)
    assert selection._bought_rank(alone) == 0  # type: ignore[arg-type]


@pytest.mark.parametrize(("pitches", "tried"), [((0.005,), True), ((), False)])
def test_a_ripple_that_the_residual_shows_nowhere_is_not_tried(
    monkeypatch: pytest.MonkeyPatch, pitches: tuple[float, ...], tried: bool
) -> None:
    """The residual is that of the model without the ripple and its parts, whichever of them are tried."""
    beside: list[frozenset[str]] = []
    monkeypatch.setattr(tuning, "screened", lambda _field, _likelihood, fit: beside.append(fit.names) or pitches)
    effects = [e for e in REGRESSED if e.name in ("speed_pickup", "belt_tooth", "belt_tooth_angle")]
    selection = Selection(SimpleNamespace(effects=effects), frozenset())  # type: ignore[arg-type]
    fit: Any = SimpleNamespace(names=frozenset({"speed_pickup"}))
    selection._memory = {n: Candidate(SimpleNamespace(names=n), 0.0) for n in (fit.names, frozenset())}  # type: ignore[arg-type]
    found = list(selection._neighbours(fit.names))
    assert any("belt_tooth" in names for names in found) == tried
    assert fit.names | {"belt_tooth"} in found or not tried
    assert beside == [fit.names, frozenset()]


@pytest.mark.parametrize(("on_grid", "looked_at"), [(2750.0, True), (2500.0, False)])
def test_a_large_effect_between_the_points_of_its_grid_is_looked_at(
    monkeypatch: pytest.MonkeyPatch, on_grid: float, looked_at: bool
) -> None:
    """A resonance gains 3000; a belt's tilt with a mode on the grid is 150 worse, refined it is 50 better."""
    selection, fit = _selection({"g_resonance": (3000.0, 2900.0)})
    selection.effects = {e.name: e for e in REGRESSED if e.name in (*NAMES, "belt_tilt_mode")}
    tilt = frozenset({"belt_tilt", "belt_tilt_mode"})
    selection._shapes = {"belt_tilt": tilt - {"belt_tilt"}}
    made: Any = SimpleNamespace(names=tilt, loglik=on_grid / 2)
    refined, best = Candidate(made, 2950.0), Candidate(fit["g_resonance"], 2900.0)
    selection._rough = {tilt: Candidate(made, on_grid)}
    monkeypatch.setattr(selection, "candidate", lambda _names: refined)
    assert selection._off_grid(best) is (refined if looked_at else best)


@pytest.mark.parametrize(("double_gain", "claimed"), [(14.0, False), (40.0, True)])
def test_one_parameter_pays_for_being_the_best_of_a_whole_catalogue(double_gain: float, claimed: bool) -> None:
    """By BIC alone, ln(200,000) = 12.2, chance passes a delay once in 2,000 looks, of which a session has dozens."""
    selection = Selection(SimpleNamespace(effects=REGRESSED, samples=200_000), frozenset())  # type: ignore[arg-type]
    default = SimpleNamespace(names=frozenset(), rank=3, loglik=0.0, templates={})
    delayed = SimpleNamespace(
        names=frozenset({"time_offset"}), rank=3, loglik=double_gain / 2, templates={"offset": 2e-3}
    )
    without, within = (selection._scored(f).score for f in (default, delayed))  # type: ignore[arg-type]
    assert (within > without) == claimed
