"""Figures of a comparison: the elements of G, every difference in standard errors, errors, noise and delay."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from math import inf, isfinite

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure as Drawing
from scipy.stats import norm

from gsense_fusion.identification.types import Parameter
from gsense_fusion.report.figures.canvas import STYLE, Figure, legend, panels, to_svg
from gsense_fusion.report.units import DEG, engineers

from .changes import Comparison, Difference, Status
from .words import half_width, status

OLD, NEW, LIMIT = "#9aa5b1", "#1261a0", "#d9730d"
UNIDENTIFIED = 10.0
"""Elements whose error is this many times the smallest one would only stretch the axis."""
MOST_BARS = 24


def figures(c: Comparison) -> tuple[Figure, ...]:
    """All figures that the comparison has data for."""
    out: list[Figure] = []

    def add(key: str, title: str, text: str, draw: Callable[[], Drawing]) -> None:
        with mpl.rc_context(STYLE):
            out.append(Figure(key, title, text, to_svg(draw(), title, key)))

    for effect in (e for e in c.effects if e.status is not Status.SESSION):
        rows = _comparable(effect.parameters)
        if rows:
            text = "Estimates with 95 % intervals; what the data does not identify is left out."
            add(effect.effect, f"{effect.effect}: {status(effect.status, c)}", text, partial(_estimates, rows))
    differences = [(e.effect, d) for e in c.effects if e.status is not Status.SESSION for d in e.parameters]
    known = [(f"{name}.{d.name}" if name != "g_sensitivity" else d.name, d.z) for name, d in differences]
    known = [(name, z) for name, z in known if isfinite(z)]
    if known:
        text = "New less old in standard errors; beyond the dashed lines one alone would be more than chance."
        add("differences", "Every parameter's difference", text, lambda: _differences(known, c.level))
    if c.old.rate_rms and c.new.rate_rms:
        text = "Held-out rate error below 5 Hz; it depends on the runs as well as on the sensor."
        add("errors", "Errors and noise floor", text, lambda: _errors(c))
    if c.old.noise and c.new.noise:
        text = "Amplitude density of the gyro at rest, 4 to 20 Hz, with 95 % intervals."
        add("noise", "Noise at rest", text, lambda: _noise(c))
    if len(c.old.delays_s) > 1 and len(c.new.delays_s) > 1:
        text = "Delay of the IMU against the encoder with its 95 % interval; small dots: what each run was given."
        add("delay", "Delay of the IMU", text, lambda: _delay(c))
    return tuple(out)


def _comparable(rows: Sequence[Difference]) -> list[Difference]:
    """Parameters of the commonest unit that the data identifies."""
    units = [d.unit for d in rows if d.identified]
    if not units:
        return []
    unit = max(dict.fromkeys(units), key=units.count)
    mine = [d for d in rows if d.unit == unit and d.identified]
    errors = [p.stderr for d in mine for p in (d.old, d.new) if p is not None and 0.0 < p.stderr < inf]
    smallest = min(errors, default=inf)
    return [d for d in mine if any(p is not None and p.stderr <= UNIDENTIFIED * smallest for p in (d.old, d.new))]


def _estimates(rows: Sequence[Difference]) -> Drawing:
    drawing, (ax,) = panels()
    scale = engineers(rows[0].unit, rows[0].name)
    ax.axhline(0, color="#8b95a1", lw=0.6)
    for shift, colour, label in ((-0.12, OLD, "OLD"), (0.12, NEW, "NEW")):
        chosen = [(i, p) for i, d in enumerate(rows) if (p := d.old if label == "OLD" else d.new) is not None]
        if not chosen:
            continue
        x = np.array([i for i, _ in chosen]) + shift
        y = np.array([p.value for _, p in chosen]) * scale.factor
        half = np.array([_drawn(p) for _, p in chosen]) * scale.factor
        ax.errorbar(x, y, half, fmt="o", ms=4.5, lw=1.3, capsize=3, color=colour, label=label)
    ax.set_xticks(range(len(rows)), [d.name for d in rows])
    ax.set_xlim(-0.6, len(rows) - 0.4)
    ax.grid(axis="x", visible=False)
    ax.set_ylabel(scale.unit)
    legend(drawing, ax)
    return drawing


def _drawn(p: Parameter) -> float:
    half = half_width(p)
    return half if isfinite(half) else 0.0


def _differences(known: Sequence[tuple[str, float]], level: float) -> Drawing:
    drawing, (ax,) = panels()
    shown = sorted(known, key=lambda item: -abs(item[1]))[:MOST_BARS][::-1]
    limit = float(norm.isf(level / 2 / max(len(known), 1)))
    y, z = np.arange(len(shown)), np.array([value for _, value in shown])
    ax.axvline(0, color="#8b95a1", lw=0.6)
    for side in (-limit, limit):
        ax.axvline(side, color=LIMIT, lw=1.0, ls="--")
    ax.hlines(y, 0, z, color=[LIMIT if abs(v) > limit else NEW for v in z], lw=1.6)
    ax.scatter(z, y, s=16, color=[LIMIT if abs(v) > limit else NEW for v in z], zorder=3)
    ax.set_yticks(y, [name for name, _ in shown], fontsize=6.5 if len(shown) > 12 else 8)
    ax.set_xlabel("difference, standard errors")
    reach = 1.15 * max(limit, float(np.abs(z).max()))
    ax.set_xlim(-reach, reach)
    ax.grid(axis="y", visible=False)
    return drawing


def _errors(c: Comparison) -> Drawing:
    drawing, (ax,) = panels()
    names = [n for n in ("raw", "declared", "full", "noise_floor") if n in c.old.rate_rms and n in c.new.rate_rms]
    x = np.arange(len(names))
    for shift, colour, label, report in ((-0.2, OLD, "OLD", c.old), (0.2, NEW, "NEW", c.new)):
        ax.bar(x + shift, [report.rate_rms[n] * DEG for n in names], width=0.38, color=colour, label=label)
    words = {"raw": "bias alone", "declared": "declared", "full": "full model", "noise_floor": "noise floor"}
    ax.set_xticks(x, [words[n] for n in names])
    ax.grid(axis="x", visible=False)
    ax.set_ylabel("deg/s")
    legend(drawing, ax)
    return drawing


def _noise(c: Comparison) -> Drawing:
    drawing, (ax,) = panels()
    axes = [x for x in c.old.noise if x in c.new.noise]
    x = np.arange(len(axes))
    for shift, colour, label, report in ((-0.1, OLD, "OLD", c.old), (0.1, NEW, "NEW", c.new)):
        y = np.array([report.noise[a].value for a in axes]) * DEG * 1e3
        half = np.array([half_width(report.noise[a]) for a in axes]) * DEG * 1e3
        ax.errorbar(x + shift, y, half, fmt="o", ms=5, lw=1.3, capsize=3, color=colour, label=label)
    ax.set_xticks(x, axes)
    ax.set_xlim(-0.6, len(axes) - 0.4)
    ax.set_ylim(bottom=0)
    ax.grid(axis="x", visible=False)
    ax.set_ylabel("1e-3 deg/s/√Hz")
    legend(drawing, ax)
    return drawing


def _delay(c: Comparison) -> Drawing:
    drawing, (ax,) = panels()
    for x, colour, report in ((0, OLD, c.old), (1, NEW, c.new)):
        y = np.array(report.delays_s) * 1e3
        ax.plot(x + np.linspace(0.1, 0.3, len(y)), y, "o", ms=3, color=colour)
        if report.delay is not None:
            half = _drawn(report.delay) * 1e3
            ax.errorbar(x, report.delay.value * 1e3, half, fmt="o", ms=5, lw=1.3, capsize=3, color=colour)
    ax.set_xticks([0, 1], ["OLD", "NEW"])
    ax.set_xlim(-0.6, 1.6)
    ax.grid(axis="x", visible=False)
    ax.set_ylabel("ms")
    return drawing
