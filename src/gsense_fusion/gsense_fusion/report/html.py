"""report.html: one self-contained page, figures inline, nothing loaded from elsewhere."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

from gsense_fusion.identification.result import LoopResult
from gsense_fusion.report import tables
from gsense_fusion.report.figures import Figure, figures
from gsense_fusion.report.next_step import next_steps
from gsense_fusion.report.units import DEG, number, rounded
from gsense_fusion.report.words import (
    badge,
    grouped,
    has_motion,
    headline_rms,
    hertz,
    judged_on,
    listing,
    one_sentence,
)

TEMPLATE, STYLE = "report.html.j2", "report.css"


def report_html(result: LoopResult) -> str:
    """The page as text: equal input gives an equal page; all text from bags is escaped."""
    return page(TEMPLATE, _content(result), figures(result))


def page(name: str, content: Mapping[str, Any], drawings: Sequence[Figure]) -> str:
    """A page of the report's look from one of the templates beside this file."""
    folder = resources.files(__package__)
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["pretty"] = tables.pretty
    template = environment.from_string((folder / name).read_text(encoding="utf-8"))
    # own text only, never a bag's: the style and Matplotlib's drawings
    style = Markup((folder / STYLE).read_text(encoding="utf-8"))  # noqa: S704
    marked = [(f, Markup(f.svg)) for f in drawings]  # noqa: S704
    return template.render(content, style=style, figures=marked)


def _content(result: LoopResult) -> dict[str, Any]:
    unexplained = result.unexplained
    return {
        "sensor": result.sensor,
        "verdict": result.verdict,
        "badge": badge(result),
        "sentence": tables.pretty(one_sentence(result)),
        "next_steps": next_steps(result),
        "charts": _charts(result),
        "facts": _facts(result),
        "findings": [tables.finding_card(f) for f in result.findings],
        "unexplained": unexplained,
        "unexplained_rms": None if unexplained is None else f"{number(unexplained.rate_rms * DEG, 2)} deg/s",
        "unexplained_si": None if unexplained is None else f"{number(unexplained.rate_rms)} rad/s",
        "unexplained_hz": [] if unexplained is None else [(hertz(w), rounded(w, 2)) for w in unexplained.frequencies],
        "declared": [tables.parameter_table(name, p) for name, p in result.declared_parameters.items()],
        "ranking": tables.ranked_rows(result),
        "undecided": grouped(result.undecided),
        "notes": result.notes,
        "runs": tables.run_rows(result.runs),
        "moving": has_motion(result),
        "judged_on": judged_on(result),
        "listing": listing,
    }


def _charts(result: LoopResult) -> list[tables.BarChart]:
    """The error that counts first, then the others that there are."""
    name, first = headline_rms(result)
    found = bool(result.findings)
    title = name.removeprefix("the ")
    charts = [tables.bars(first, title[0].upper() + title[1:], found=found)]
    if first is result.rate_rms and result.pose_rms is not None:
        charts.append(tables.bars(result.pose_rms, "Error of the mean rate at rest", found=found))
    elif first is not result.rate_rms:
        charts.append(tables.bars(result.rate_rms, "Rate error below 5 Hz", found=found))
    if not has_motion(result):  # at rest, with each run's own bias, attitude says nothing of the models
        return charts
    if result.attitude_gyro_only is not None:
        charts.append(tables.bars(result.attitude_gyro_only, "Attitude, gyro alone", found=found, angle=True))
    if result.attitude_madgwick is not None:
        charts.append(tables.bars(result.attitude_madgwick, "Attitude, Madgwick's filter", found=found, angle=True))
    return charts


def _facts(result: LoopResult) -> list[tuple[str, str]]:
    runs = result.runs
    held = sum(r.role == "held_out" for r in runs)
    samples, lost = sum(r.samples for r in runs), sum(r.lost for r in runs)
    share = f" ({100.0 * lost / (samples + lost):.2g} %)" if lost else ""
    return [
        ("sensor", result.sensor),
        ("unit", result.unit_id or "not named"),
        ("runs", f"{len(runs) - held} fitted, {held} held out" if held else f"{len(runs)}, held out in turn"),
        ("sessions", str(len({r.session for r in runs}))),
        ("samples", f"{samples:,}".replace(",", "\N{NARROW NO-BREAK SPACE}")),
        ("lost", f"{lost}{share}"),
        ("declared model", listing(result.declared) if result.declared else "empty"),
    ]
