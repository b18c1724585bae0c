"""From the best model to claims: vetoes, rivals, and what remains unexplained."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

from gsense_fusion.identification.effects.quantization import Rounding
from gsense_fusion.identification.effects.statistical import Explanation, StatisticalEffect
from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.search.selection import RIVAL_LOGLIK, Selection
from gsense_fusion.identification.search.soundness import sound
from gsense_fusion.identification.verdict.models import claimed_fit
from gsense_fusion.identification.verdict.noise_effects import explain_noise, without_drift
from gsense_fusion.identification.verdict.residual import residuals
from gsense_fusion.identification.verdict.sufficiency import Symptom
from gsense_fusion.identification.verdict.unequal import companions, unequal_among, unequal_symptom
from gsense_fusion.identification.verdict.vetoes import Refusal, refines, refused, removed_part, rests_on_motion

IN_MOTION = frozenset({"orders", "kicks", "unequal", "lines", "band", "uneven", "intensity"})
"""Kinds of symptoms that only motion shows."""
LOCKED_PART = 0.8
"""A claim stays only if it removes this part of the drive-locked structure, where some is left."""

ONLY_REFINED = "is sound only with what refines its shape: no claim"
ONLY_IN_PART = "is sound only without a further term that it has: no claim"
REFUTED = "says of the runs held out what they do not show: no claim"


@dataclass(frozen=True)
class Claims:
    """What is claimed, with the models that lead there."""

    full: Fit
    """The declared effects and all claims."""
    ladder: Mapping[str, Fit]
    """declared, then one model after each claim (named after it), and full."""
    names: tuple[str, ...]
    """Claimed effects, strongest first."""
    symptoms: tuple[Symptom, ...]
    nearest: tuple[str, ...]
    """Effects of the catalogue that come nearest to what is unexplained."""
    notes: tuple[str, ...]
    noise: Mapping[str, Explanation] = field(default_factory=dict)
    """Claimed effects that change the noise, by name."""
    undecided: Mapping[str, str] = field(default_factory=dict)
    """Effects that may be there and are no claim, with the reason."""


def judge(
    selection: Selection,
    best: Fit,
    statistical: Sequence[StatisticalEffect] = (),
    rounded: Rounding | None = None,
    refuted: Collection[str] = (),
) -> Claims:
    """Apply the vetoes to the best model and test what is left.

    Args:
        selection: The models tried.
        best: The best of them.
        statistical: Effects that change the noise.
        rounded: What the step of the output does.
        refuted: Effects of the best model that the runs held out speak against.

    """
    likelihood = selection.likelihood
    names, refinements, refusals = _vetted(selection, best, rounded, refuted)
    notes = [f"{n} {r.reason}" for n, r in refusals.items() if not r.undecided]
    undecided = {n: r.reason for n, r in refusals.items() if r.undecided}
    tested = claimed_fit(selection, names + refinements)
    left = residuals(likelihood, tested, likelihood.campaign.fit)
    symptoms, explained = explain_noise(likelihood, tested, left, statistical)
    unequal = unequal_among(selection, tested, names)
    symptoms += [unequal_symptom(selection, tested, n) for n in unequal]
    demoted = unequal + companions(selection, names, refinements, unequal)
    names = [n for n in names if n not in demoted]
    if unequal or any(s.kind == "orders" for s in symptoms):
        rest = claimed_fit(selection, names + refinements)
        demoted += [n for n in names if selection.effects[n].dynamic and removed_part(selection, rest, n) < LOCKED_PART]
        names = [n for n in names if n not in demoted]
    if any(s.kind in IN_MOTION for s in symptoms):
        lingers = any(s.kind == "intensity" for s in symptoms)
        slow = [n for n in names if not selection.effects[n].dynamic]
        doubtful = [n for n in slow if rests_on_motion(selection, names, n, lingers)]
        notes += [f"{n} rests on the means in motion, where something is unexplained: no claim" for n in doubtful]
        names = [n for n in names if n not in doubtful]
    if any(s.kind in IN_MOTION | {"course"} for s in symptoms):
        explained, drifts = without_drift(explained, likelihood, tested, left)
        symptoms += drifts
    full = claimed_fit(selection, names)
    nearest = tuple(demoted) + tuple(n for n in _nearest(selection, full) if n not in demoted) if symptoms else ()
    ladder = _ladder(selection, names)
    return Claims(full, ladder, tuple(names), tuple(symptoms), nearest, tuple(notes), explained, undecided)


def _vetted(
    selection: Selection, best: Fit, rounded: Rounding | None, refuted: Collection[str]
) -> tuple[list[str], list[str], dict[str, Refusal]]:
    """Effects of the best model that pass the vetoes, strongest first; what refines a shape; and what was refused."""
    refusals: dict[str, Refusal] = {}
    terms = frozenset(n for n, e in selection.effects.items() if e.part_of is not None)
    found = sorted(best.names - selection.declared - terms, key=lambda n: -selection.gain(best, n)[0])
    names: list[str] = []
    refinements: list[str] = []
    for name in found:
        if name in refuted:
            refusals[name] = Refusal(REFUTED)
        elif (why := refines(selection, best, found, name)) is not None:
            refusals[name] = Refusal(f"{why}: a refinement of shape, not a claim")
            refinements.append(name)
        elif (refusal := refused(selection, best, name, rounded)) is not None:
            refusals[name] = refusal
        else:
            names.append(name)
    alone = claimed_fit(selection, names)
    larger = _bought_for(selection, alone) if alone.names - best.names else frozenset()
    for name in [n for n in names if (refinements or n in larger) and not sound(selection, alone, n)]:
        names.remove(name)
        refusals[name] = Refusal(ONLY_REFINED if refinements else ONLY_IN_PART)
    return names, refinements, refusals


def _bought_for(selection: Selection, fit: Fit) -> frozenset[str]:
    """Effects of a model for which it bought a further term that is searched by itself, as a second mode is.

    The terms that come with a claim may leave such a pair free to stand for anything.
    """
    terms = (selection.effects[n] for n in fit.names & selection.bought)
    return frozenset(t.part_of for t in terms if t.part_of is not None and t.parameters and t.templates)


def _ladder(selection: Selection, names: Sequence[str]) -> dict[str, Fit]:
    steps = {"declared": claimed_fit(selection, ())}
    for i in range(len(names)):
        allowed = frozenset(names[: i + 1]) | selection.declared
        # an effect that needs a later one (time_offset needs G) comes into the model with it
        needs = frozenset(need for n in allowed for need in selection.effects[n].needs)
        steps[names[i]] = selection.candidate(selection.with_parts(allowed | needs)).fit
    steps["full"] = claimed_fit(selection, names)
    return steps


def _nearest(selection: Selection, full: Fit) -> list[str]:
    """Effects that would explain some of the rest, best first."""
    gains = []
    for name in selection.claimable():
        names = full.names | {name}
        if name in full.names or not selection.allowed(names):
            continue
        gain = 2 * (selection.rough(names).fit.loglik - full.loglik)
        if gain > RIVAL_LOGLIK:
            gains.append((gain, name))
    return [name for _, name in sorted(gains, reverse=True)]
