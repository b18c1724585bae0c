"""What changed, in words: the conclusion in one sentence, and a line for each thing compared."""

from __future__ import annotations

from math import isfinite

from gsense_fusion.identification.types import Parameter
from gsense_fusion.report.units import COVERAGE_95, engineers, interval, number, probability
from gsense_fusion.report.words import listing

from .changes import Comparison, Difference, EffectChange, ScalarChange, Status

BADGES = {"changed": "something changed", "nothing_changed": "nothing changed"}
BADGES_OF_TWO = {"changed": "the units differ", "nothing_changed": "the units agree"}
STATUS_OF_TWO = {Status.DRIFTED: "differs", Status.ENTERED: "in NEW only", Status.GONE: "in OLD only"}
"""Of two units nothing has changed in time."""


def one_sentence(c: Comparison) -> str:
    """The conclusion with its numbers, in plain ASCII."""
    parts = [_effect(e, c) for e in c.changed_effects]
    if c.unexplained in (Status.ENTERED, Status.GONE):
        report = c.new if c.unexplained is Status.ENTERED else c.old
        parts.append(f"something unexplained {_verb(c.unexplained, c)} ({report.unexplained})")
    parts += [f"{s.name} {_went(c)} {scalar_change(s)}" for s in c.changed_scalars]
    head = listing(parts) if parts else f"{'no difference' if c.two_units else 'nothing changed'}{_agreement(c)}"
    more = [f"{e.effect} is now named ({e.note})" for e in c.effects if e.status is Status.SETTLED]
    more += [f"{e.effect} stands in one report only, but {e.note}" for e in c.effects if e.status is Status.UNSURE]
    return f"{who(c)}: {'; '.join([head, *more])}."


def who(c: Comparison) -> str:
    """Sensor, and the unit or units."""
    if c.two_units:
        return f"{c.new.sensor}, units {c.old.unit_id} (OLD) and {c.new.unit_id} (NEW)"
    unit = c.old.unit_id or c.new.unit_id
    return f"{c.new.sensor} {unit}" if unit else c.new.sensor


def badge(c: Comparison) -> str:
    """The verdict in a few words."""
    return (BADGES_OF_TWO if c.two_units else BADGES)[c.verdict]


def status(found: Status, c: Comparison) -> str:
    """What became of an effect, in a word or two."""
    return STATUS_OF_TWO.get(found, found.value) if c.two_units else found.value


def difference(d: Difference) -> str:
    """New less old with its 95 % interval; a dash where only one has the parameter."""
    if d.old is None or d.new is None or not isfinite(d.stderr):
        return "-"
    if not d.identified:
        return "not identified"
    return interval(Parameter(d.value, d.stderr, d.unit), d.name)


def value(p: Parameter | None, name: str) -> str:
    """A parameter with its interval."""
    return "-" if p is None else interval(p, name)


def scalar_difference(s: ScalarChange) -> str:
    """New less old with its 95 % interval."""
    if s.p_value is None:
        return f"{100.0 * (s.new.value / s.old.value - 1.0):+.0f} %" if s.old.value else "-"
    return interval(s.difference, s.name)


def scalar_change(s: ScalarChange) -> str:
    """From the old to the new value, in engineers' units."""
    scale = engineers(s.unit, s.name)
    text = f"from {number(s.old.value * scale.factor)} to {number(s.new.value * scale.factor)} {scale.unit}"
    return text if s.p_value is None else f"{text} ({probability(s.p_value)})"


def _verb(found: Status, c: Comparison) -> str:
    word = status(found, c)
    return f"is {word}" if found is Status.GONE or word.startswith("in ") else word


def _went(c: Comparison) -> str:
    return "goes" if c.two_units else "went"


def _effect(e: EffectChange, c: Comparison) -> str:
    owner = f" ({e.owner})" if e.owner else ""
    text = f"{e.effect}{owner} {_verb(e.status, c)}"
    if e.status is Status.DRIFTED:
        k = c.k
        if e.effect == "g_sensitivity" and k is not None and k.p_value is not None and k.p_value < c.level:
            return f"{text}: k {_went(c)} {scalar_change(k)}, by {scalar_difference(k)}"
        most = max((d for d in e.parameters if isfinite(d.z)), key=lambda d: abs(d.z), default=None)
        where = "" if most is None else f": {most.name} by {difference(most)}"
        return text + where + ("" if e.p_value is None else f" ({probability(e.p_value)})")
    lead = _lead(e)
    return text + ("" if lead is None else f" with {lead}")


def _lead(e: EffectChange) -> str | None:
    """The parameter that is surest in the report that names the effect."""
    known = [(d.name, d.new if e.status is Status.ENTERED else d.old) for d in e.parameters]
    sure = [(n, p) for n, p in known if p is not None and 0.0 < p.stderr < float("inf")]
    if not sure:
        return None
    name, p = max(sure, key=lambda item: abs(item[1].value) / item[1].stderr)
    return f"{name} = {interval(p, name)}"


def _agreement(c: Comparison) -> str:
    """How well the two agree, where nothing changed."""
    out = []
    if c.k is not None:
        out.append(f"k differs by {scalar_difference(c.k)}")
    out += [
        f"{e.effect} by chi2 = {e.chi2:.1f} of {e.dof}, {probability(e.p_value)}"
        for e in c.effects
        if e.status is Status.SAME and e.p_value is not None and e.chi2 is not None
    ]
    return f" ({listing(out)})" if out else ""


def half_width(p: Parameter) -> float:
    """Of the 95 % interval, in the parameter's unit."""
    return COVERAGE_95 * p.stderr
