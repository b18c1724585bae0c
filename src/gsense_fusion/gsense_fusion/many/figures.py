"""Figures of the summary: k and the effects of each unit over time, and the errors against the noise floor."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from functools import partial
from math import isfinite
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter
from matplotlib.figure import Figure as Drawing

from gsense_fusion.comparison.snapshot import Estimate, Presence
from gsense_fusion.identification.types import Parameter
from gsense_fusion.report.figures.canvas import STYLE, Figure, legend, panels, plain_log, to_svg
from gsense_fusion.report.units import COVERAGE_95, engineers

from .overview import Overview, Row, Unit

COLOURS = ("#1261a0", "#d9730d", "#1d7a46", "#a3195b", "#6b4fa0", "#8a6d00", "#20262d", "#4aa3c7")
MARKERS = "os^DvP*X"
MOST_EFFECTS = 12
MOST_NAMES = 8
"""Units in a legend."""
SINGLE_DAY_NS = 120 * 10**9


def figures(view: Overview) -> tuple[Figure, ...]:
    """All figures that the sessions have data for."""
    out: list[Figure] = []

    def add(key: str, title: str, text: str, draw: Callable[[], Drawing]) -> None:
        with mpl.rc_context(STYLE):
            out.append(Figure(key, title, text, to_svg(draw(), title, key)))

    if any(row.k is not None for row in view.rows):
        add(
            "k",
            "k over time",
            "By unit (numbers as below), with 95 % intervals; lines: each unit's mean.",
            lambda: _k(view),
        )
    for name, _ in Counter(e.effect for row in view.rows for e in row.found).most_common(MOST_EFFECTS):
        lead = _lead(view, name)
        if lead is not None:
            text = "By unit, with 95 % intervals: filled where it was found, hollow where it was sought and not found."
            add(name, f"{name}: {lead} over time", text, partial(_effect, view, name, lead))
    if any(row.report is not None and row.report.rate_rms for row in view.rows):
        text = "Held-out rate error below 5 Hz over the noise floor: declared model (light), with the findings (dark)."
        add("errors", "Errors over the noise floor", text, lambda: _errors(view))
    return tuple(out)


def _colours(view: Overview) -> list[tuple[Unit, str, str, str]]:
    """Each unit with its colour, marker and label."""
    several = len({u.sensor for u in view.units}) > 1
    return [
        (
            u,
            COLOURS[i % len(COLOURS)],
            MARKERS[i // len(COLOURS) % len(MARKERS)],
            (f"{i + 1}, {u.sensor}" if several else f"{i + 1}") if i < MOST_NAMES else "_",
        )
        for i, u in enumerate(view.units)
    ]


def _places(view: Overview) -> tuple[dict[str, Any], bool]:
    """Where each session stands on the axis, and whether that is a time."""
    starts = {r.name: r.start_ns for r in view.rows if r.report is not None}
    known = [s for s in starts.values() if s is not None]
    if len(known) == len(starts) and known and max(known) - min(known) > SINGLE_DAY_NS:
        return {n: datetime.fromtimestamp((s or 0) * 1e-9, tz=timezone.utc) for n, s in starts.items()}, True
    return {name: place for place, name in enumerate(starts)}, False


def _dress(ax: Any, *, dates: bool) -> None:
    if dates:
        locator = AutoDateLocator()  # type: ignore[no-untyped-call]
        ax.xaxis.set_major_locator(locator)
        ax.xaxis.set_major_formatter(ConciseDateFormatter(locator))  # type: ignore[no-untyped-call]
    else:
        ax.set_xlabel("session, in the manifest's order")


def _points(ax: Any, x: Sequence[Any], values: Sequence[Parameter], scale: float, **style: Any) -> None:
    y = np.array([p.value for p in values]) * scale
    half = np.array([p.stderr if isfinite(p.stderr) else 0.0 for p in values]) * scale * COVERAGE_95
    ax.errorbar(x, y, half, lw=1.0, capsize=2, ms=4, ls="none", **style)


def _k(view: Overview) -> Drawing:
    drawing, (ax,) = panels()
    places, dates = _places(view)
    unit = next(row.k.value.unit for row in view.rows if row.k is not None)
    scale = engineers(unit, "k")
    for u, colour, marker, label in _colours(view):
        rows = [(row, row.k.value) for row in u.rows if row.k is not None]
        if not rows:
            continue
        x = [places[row.name] for row, _ in rows]
        _points(ax, x, [k for _, k in rows], scale.factor, fmt=marker, color=colour, label=label)
        if u.constancy is not None:
            mean = u.constancy.mean.value * scale.factor
            ax.plot([min(x), max(x)], [mean, mean], color=colour, lw=0.8)
    ax.set_ylabel(scale.unit)
    _dress(ax, dates=dates)
    if len(view.units) > 1:
        legend(drawing, ax, 3)
    return drawing


def _lead(view: Overview, effect: str) -> str | None:
    """The parameter that is surest over all sessions that found the effect."""
    sure: Counter[str] = Counter()
    for row in view.rows:
        for e in row.found:
            if e.effect == effect:
                for name, p in e.parameters.items():
                    if 0.0 < p.stderr < np.inf:
                        sure[name] += min(abs(p.value) / p.stderr, 1e3)  # type: ignore[assignment]
    return max(sure, key=lambda name: sure[name]) if sure else None


def _effect(view: Overview, effect: str, lead: str) -> Drawing:
    drawing, (ax,) = panels()
    places, dates = _places(view)
    scale = None
    for u, colour, marker, label in _colours(view):
        found, sought = ([(r, e) for r in u.rows if (e := _estimate(r, effect, lead, p))] for p in _SHOWN)
        for rows, fill, text in ((sought, "none", "_"), (found, colour, label)):
            if rows:
                values = [e.parameters[lead] for _, e in rows]
                scale = scale or engineers(values[0].unit, lead)
                x = [places[r.name] for r, _ in rows]
                style = {"fmt": marker, "color": colour, "mfc": fill, "label": text}
                _points(ax, x, values, scale.factor, **style)
    ax.axhline(0, color="#8b95a1", lw=0.6)
    if scale is not None:
        ax.set_ylabel(scale.unit)
    _dress(ax, dates=dates)
    if len(view.units) > 1:
        legend(drawing, ax, 3)
    return drawing


_SHOWN = (Presence.FOUND, Presence.NOT_FOUND)


def _estimate(row: Row, effect: str, lead: str, presence: Presence) -> Estimate | None:
    e = None if row.report is None else row.report.effects.get(effect)
    return e if e is not None and e.presence is presence and lead in e.parameters else None


def _errors(view: Overview) -> Drawing:
    drawing, (ax,) = panels()
    places, dates = _places(view)
    for key, colour, label in (("declared", "#9aa5b1", "declared model"), ("full", "#1261a0", "with the findings")):
        points = [
            (places[row.name], row.report.rate_rms[key] / row.report.rate_rms["noise_floor"])
            for row in view.rows
            if row.report is not None and row.report.rate_rms.get("noise_floor") and key in row.report.rate_rms
        ]
        ax.plot([x for x, _ in points], [y for _, y in points], "o", ms=3.5, color=colour, label=label)
    ax.axhline(1.0, color="#20262d", lw=0.8, ls="--")
    ax.set_yscale("log")
    plain_log(ax.yaxis)
    ax.set_ylabel("times the noise floor")
    _dress(ax, dates=dates)
    legend(drawing, ax)
    return drawing
