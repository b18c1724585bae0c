"""One session through the identification, and what it got right."""

from __future__ import annotations

import time
import traceback
from dataclasses import dataclass, field, replace
from typing import Any

from gsense_fusion.identification.engine import Settings, close_loop
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import Role

from .cases import Case, with_disturbances
from .peers import Peer, peers, same
from .reference import held_out_rms, true_noise
from .simulator import Session, simulate
from .simulator.disturbances import NAMED

TAKEN_OUT_EVERY = 4
"""One in so many large single effects is analysed again without its entry of the catalogue."""
KNOWN_G = 3e-5
"""(rad/s)/(m/s^2): entries of G with a smaller standard error are identified."""
LEAST_REMOVABLE = 0.02
"""Of the noise's mean square: the errors of G alone are some thousandths of it."""
AS_SIZED = {"temperature_bias": "c", "supply": "c", "brush_current": "c", "bias_jump": "d"}
"""Parameter of each mechanism that has the catalogue's own form: size times direction."""


@dataclass
class Outcome:
    """What was found in one session; all fields can be written as JSON."""

    group: str
    label: str
    energy: float
    seed: int
    verdict: str = "error"
    found: list[str] = field(default_factory=list)
    rivals: list[list[str]] = field(default_factory=list)
    """Listed alternatives of each finding."""
    exact: bool = False
    within_rivals: bool = False
    wrong: bool = False
    """Wrong and confident: `effects_found` though neither the named effects nor their rivals are the true ones."""
    said_open: bool = False
    """Wrong, yet all that is missing is listed as undecided."""
    left_open: list[str] = field(default_factory=list)
    """Effects that are said to be undecided, with the run that would decide."""
    floor_ratio: float = float("nan")
    """Held-out `full` over the root mean square of the realised noise."""
    stated_floor_ratio: float = float("nan")
    """The engine's `noise_floor` over the same."""
    removed: float = float("nan")
    """Part of the removable mean square that the findings remove, where there is so much that it can be measured."""
    z: dict[str, float] = field(default_factory=dict)
    """(estimate - truth) / stderr of each parameter whose truth is known."""
    without: str = ""
    """Verdict with the true effect and its listed rivals out of the catalogue; empty where it was not tried."""
    peers: dict[str, dict[str, Any]] = field(default_factory=dict)
    """By method: found, exact (None for a fixed model), floor_ratio."""
    why: str = ""
    seconds: float = 0.0


def analyse(session: Session, settings: Settings | None = None) -> LoopResult:
    """The session through the engine."""
    return close_loop(
        [(run, Role(role)) for run, role in session.runs], settings or Settings(session.runs[0][0].sensor)
    )


def without_them(case: Case, session: Session, out: Outcome) -> LoopResult:
    """The analysis by a catalogue that has neither the true effect nor its rivals."""
    settings = Settings(session.runs[0][0].sensor)
    gone = case.names.union(*out.rivals, case.beside)
    kept = tuple(e for e in settings.catalogue if e.name not in gone and e.part_of not in gone)
    kept = tuple(e for e in kept if not gone.intersection(e.needs))
    return analyse(session, replace(settings, catalogue=kept))


def judge(case: Case) -> Outcome:
    """Simulate, analyse, compare; an exception is an outcome of its own."""
    out = Outcome(case.group, case.label, case.energy, case.seed)
    try:
        session = simulate(with_disturbances(case))
        start = time.process_time()
        result = analyse(session)
        out.seconds = time.process_time() - start
        compare(case, session, result, out)
        if case.group == "single" and case.energy >= 4000 and out.exact and case.seed % TAKEN_OUT_EVERY == 0:
            out.without = without_them(case, session, out).verdict
    except Exception:  # noqa: BLE001  (one bad session must not end a study of hours)
        out.why = traceback.format_exc(limit=-3)
    return out


def compare(case: Case, session: Session, result: LoopResult, out: Outcome) -> None:
    """Fill in the outcome."""
    truth = case.names if case.group in ("single", "pair") else frozenset()
    named = [(f.effect, f.alternatives) for f in result.findings if f.effect not in case.beside]
    out.verdict = result.verdict
    out.found = sorted(f.effect for f in result.findings)
    out.rivals = [list(f.alternatives) for f in result.findings]
    out.left_open = sorted(result.deciding_runs)
    confident = result.verdict == "effects_found"
    if case.group == "outside":
        out.exact = out.within_rivals = result.verdict == "unexplained" and not named
        out.wrong = confident
    elif case.group == "null":
        out.exact = out.within_rivals = result.verdict == "nothing_missing"
        out.wrong = confident
    else:
        out.exact = confident and frozenset(n for n, _ in named) == truth
        out.within_rivals = confident and reachable(named, truth, case.beside)
        out.wrong = confident and not out.within_rivals
        out.said_open = out.wrong and reachable(named, truth, case.beside, frozenset(out.left_open))
    noise = held_out_rms(session, true_noise(session))
    out.floor_ratio = result.rate_rms.full / noise
    out.stated_floor_ratio = (result.rate_rms.noise_floor or float("nan")) / noise
    out.peers = {name: _peer(p, truth) for name, p in peers(session, noise).items()}
    removable = result.rate_rms.declared**2 - noise**2
    if removable > LEAST_REMOVABLE * noise**2:
        out.removed = 1.0 - (result.rate_rms.full**2 - noise**2) / removable
    out.z = deviations(session, result) if out.exact else {}
    if result.unexplained is not None:
        out.why = result.unexplained.description


def _peer(peer: Peer, truth: frozenset[str]) -> dict[str, Any]:
    exact = same(peer.found, truth) if peer.selects else None
    return {"found": peer.found, "exact": exact, "floor_ratio": peer.floor_ratio}


def reachable(
    named: list[tuple[str, tuple[str, ...]]],
    truth: frozenset[str],
    beside: frozenset[str],
    left_open: frozenset[str] = frozenset(),
) -> bool:
    """Whether the true set comes out when each name may be one of its listed rivals.

    What is `beside` may be named too; of the true set, what is `left_open` need not be named.
    """
    if not named:
        return truth <= left_open
    (name, rivals), rest = named[0], named[1:]
    if beside & {name, *rivals} and reachable(rest, truth, beside, left_open):
        return True
    return any(reachable(rest, truth - {n}, beside, left_open) for n in (name, *rivals) if n in truth)


def deviations(session: Session, result: LoopResult) -> dict[str, float]:
    """(estimate - truth) / stderr of the found parameters whose truth is known."""
    size = {d.kind: d.size for d in session.parameters.disturbances}
    true: dict[tuple[str, str], float] = {}
    for kind, letter in AS_SIZED.items():
        if kind in size:
            true |= {(NAMED[kind], f"{letter}_{a}"): size[kind] * session.direction[i] for i, a in enumerate("xyz")}
    if "time_offset" in size:
        true["time_offset", "tau"] = size["time_offset"]
    if "rail_curvature" in size and session.parameters.rail_shape == "arc":
        true |= {("rail_curvature", f"t_{a}"): session.rail_slope[i] for i, a in enumerate("xyz")}
        true |= {("rail_curvature", f"u_{a}"): session.rail_bend[i] for i, a in enumerate("xyz")}
    found = {(f.effect, n): p for f in result.findings for n, p in f.parameters.items()}
    for i, row in enumerate("xyz"):
        true |= {("g_sensitivity", f"g_{row}{c}"): session.g_matrix[i, j] for j, c in enumerate("xyz")}
    declared = result.declared_parameters.get("g_sensitivity", {})
    found |= {("g_sensitivity", n): p for n, p in declared.items() if p.stderr < KNOWN_G}
    return {
        f"{effect} {name}": float((p.value - true[effect, name]) / p.stderr)
        for (effect, name), p in found.items()
        if (effect, name) in true and p.stderr > 0
    }
