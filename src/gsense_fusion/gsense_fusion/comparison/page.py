"""compare.html: one self-contained page in the report's look."""

from __future__ import annotations

from math import isfinite
from typing import Any

from gsense_fusion.report.html import page
from gsense_fusion.report.tables import pretty
from gsense_fusion.report.units import probability

from .changes import FALSE_ALARM, Comparison, Difference, EffectChange, ScalarChange
from .figures import figures
from .words import badge, difference, one_sentence, scalar_difference, status, value, who

TEMPLATE = "compare.html.j2"
LOUD = 3.0
"""Standard errors from which on a difference is bold."""


def comparison_html(c: Comparison) -> str:
    """The page as text: equal input gives an equal page."""
    return page(TEMPLATE, _content(c), figures(c))


def _content(c: Comparison) -> dict[str, Any]:
    scalars = ([] if c.k is None else [c.k]) + list(c.scalars)
    unexplained = None
    if c.unexplained is not None:
        old, new = (s.unexplained or "nothing" for s in (c.old, c.new))
        unexplained = {"status": status(c.unexplained, c), "old": old, "new": new}
    return {
        "who": who(c),
        "badge": badge(c),
        "changed": c.verdict == "changed",
        "sentence": pretty(one_sentence(c)),
        "old": c.old,
        "new": c.new,
        "warnings": c.warnings,
        "effects": [_effect(e, status(e.status, c)) for e in c.effects],
        "unexplained": unexplained,
        "scalars": [_scalar(s) for s in scalars],
        "percent": f"{100 * FALSE_ALARM:g}",
    }


def _effect(e: EffectChange, found: str) -> dict[str, Any]:
    test = ""
    if e.chi2 is not None and e.p_value is not None:
        test = pretty(f"chi2 = {e.chi2:.1f} of {e.dof}, {probability(e.p_value)}")
    return {
        "effect": e.effect,
        "owner": e.owner,
        "status": found,
        "test": test,
        "note": e.note,
        "rows": [_row(d) for d in e.parameters],
    }


def _row(d: Difference) -> dict[str, Any]:
    known = isfinite(d.z) or not (d.old and d.new)
    return {
        "name": d.name,
        "old": pretty(value(d.old, d.name)),
        "new": pretty(value(d.new, d.name)),
        "difference": pretty(difference(d)),
        "z": pretty(f"{d.z:+.1f}") if isfinite(d.z) else "",
        "known": known,
        "loud": isfinite(d.z) and abs(d.z) > LOUD,
    }


def _scalar(s: ScalarChange) -> dict[str, str]:
    return {
        "name": s.name,
        "old": pretty(value(s.old, s.name)),
        "new": pretty(value(s.new, s.name)),
        "difference": pretty(scalar_difference(s)),
        "chance": "" if s.p_value is None else pretty(probability(s.p_value)),
    }
