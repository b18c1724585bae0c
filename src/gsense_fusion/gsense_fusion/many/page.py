"""summary.html: one self-contained page in the report's look."""

from __future__ import annotations

from typing import Any
from urllib.parse import quote

from gsense_fusion.closing import REPORT_HTML
from gsense_fusion.report.html import page
from gsense_fusion.report.tables import pretty
from gsense_fusion.report.units import DEG, interval, probability, together
from gsense_fusion.report.words import lead_of, listing

from .figures import figures
from .folder import iso
from .overview import Overview, Row, Unit
from .work import State

TEMPLATE = "many.html.j2"
WORDS = {"effects_found": "effects found", "nothing_missing": "nothing is missing", "unexplained": "unexplained"}


def summary_html(view: Overview) -> str:
    """The page as text: equal input gives an equal page."""
    return page(TEMPLATE, _content(view), figures(view))


def one_line(view: Overview) -> str:
    """All sessions in one sentence."""
    states, verdicts = view.states, view.verdicts
    done = [f"{WORDS[v]} in {verdicts[v]}" for v in WORDS if verdicts.get(v)]
    parts = [f"{len(view.rows)} sessions of {_count(len(view.units), 'unit')}", *done]
    if states.get(State.FAILED.value):
        parts.append(f"{states[State.FAILED.value]} failed")
    if states.get(State.PENDING.value):
        parts.append(f"{states[State.PENDING.value]} not reached yet")
    moved = [u.unit_id for u in view.units if u.constancy is not None and u.constancy.p_value < view.level]
    if moved:
        parts.append(f"k moved in {listing(moved)}")
    return "; ".join(parts)


def _count(n: int, what: str) -> str:
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def _content(view: Overview) -> dict[str, Any]:
    failed = [row for row in view.rows if row.state is State.FAILED]
    return {
        "sentence": pretty(one_line(view)),
        "look": "unexplained" if failed else "nothing_missing",
        "badge": f"{len(failed)} failed" if failed else "all analysed",
        "pending": [row.name for row in view.rows if row.state is State.PENDING],
        "failed": failed,
        "units": [_unit(i, u, view.level) for i, u in enumerate(view.units)],
        "percent": f"{100 * view.level:.2g}",
    }


def _unit(number: int, u: Unit, level: float) -> dict[str, Any]:
    c = u.constancy
    k = ""
    if c is not None:
        said = "k moved" if c.p_value < level else "k stayed"
        k = f"{said}: mean {interval(c.mean, 'k')}, chi2 = {c.chi2:.1f} of {c.dof}, {probability(c.p_value)}"
    effects = [f"{name} in {n}" for name, n in u.effects.most_common()]
    return {
        "number": number + 1,
        "sensor": u.sensor,
        "unit_id": u.unit_id,
        "k": pretty(k),
        "effects": listing(effects) if effects else "none",
        "rows": [_row(row) for row in u.rows],
    }


def _row(row: Row) -> dict[str, Any]:
    report = row.report
    assert report is not None  # noqa: S101 # units hold reports alone
    rms = report.rate_rms
    errors = [rms[n] * DEG for n in ("declared", "full", "noise_floor") if n in rms]
    found = []
    for e in row.found:
        lead = lead_of(e.parameters)
        found.append(e.effect if lead is None else f"{e.effect} ({lead[0]} = {interval(lead[1], lead[0])})")
    return {
        "name": row.name,
        "link": f"{quote(row.name)}/{REPORT_HTML}",
        "start": "" if row.start_ns is None else iso(row.start_ns)[:16].replace("T", " "),
        "verdict": WORDS.get(report.verdict, report.verdict),
        "findings": pretty("; ".join(found)),
        "unexplained": report.unexplained or "",
        "k": "" if row.k is None else pretty(interval(row.k.value, "k")),
        "errors": " / ".join(together(*errors)) if errors else "",
    }
