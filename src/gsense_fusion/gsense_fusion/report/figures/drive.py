"""Figures of runs in motion: error per run, orders of the drive, the ellipse, the map over position."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import MaxNLocator

from gsense_fusion.identification.result import Ellipse, OrderSpectrum, PositionMap, RunErrors
from gsense_fusion.report.figures.canvas import COLOURS, LABELS, Models, legend, name_axis, panels, plain_log
from gsense_fusion.report.units import DEG

MAX_TICKS = 14
LOG_RATIO = 12.0
"""From this ratio of the largest to the smallest error on, the axis is logarithmic."""


def per_run(errors: Sequence[RunErrors], models: Models) -> Drawing:
    """Held-out error of each run for the three models against its noise floor."""
    drawing, (ax,) = panels()
    x = np.arange(len(errors))
    floor = np.array([e.noise_floor for e in errors]) * DEG
    ax.bar(x, floor, width=0.86, color="#e3e7eb", label=LABELS["noise"])
    ax.hlines(floor, x - 0.43, x + 0.43, color=COLOURS["noise"], lw=1.1)
    values = {m: np.array([getattr(e, m) for e in errors]) * DEG for m in models}
    for shift, (model, y) in zip(np.linspace(-0.22, 0.22, len(models)), values.items(), strict=True):
        ax.plot(x + shift, y, "o", ms=5.0 if len(x) < 25 else 3.0, color=COLOURS[model], label=LABELS[model])
    everything = np.concatenate([floor, *values.values()])
    positive = everything[everything > 0]
    if len(positive) and positive.max() > LOG_RATIO * positive.min():
        ax.set_yscale("log")
        ax.set_ylim(positive.min() / 2, positive.max() * 1.5)
        plain_log(ax.yaxis)
    else:
        ax.set_ylim(bottom=0)
    moving = any(e.angular_frequency is not None for e in errors)
    step = max(1, -(-len(errors) // MAX_TICKS))
    labels = [_run_label(e) if moving else f"{i + 1}" for i, e in enumerate(errors)]
    ax.set_xticks(x[::step], labels[::step])
    ax.set_xlim(-0.6, len(errors) - 0.4)
    ax.grid(axis="x", visible=False)
    ax.set_xlabel("drive of the held-out run, rad/s" if moving else "held-out still stretch")
    ax.set_ylabel("rate error below 5 Hz, deg/s")
    legend(drawing, ax)
    return drawing


def _run_label(error: RunErrors) -> str:
    return "rest" if error.angular_frequency is None else f"{error.angular_frequency:.3g}"


def orders(spectrum: OrderSpectrum, axes: Sequence[int], models: Models) -> Drawing:
    """Amplitude of the residual at half-orders of the drive."""
    drawing, rows = panels(len(axes))
    for ax, axis in zip(rows, axes, strict=True):
        noise = np.maximum(spectrum.noise[:, axis] * DEG, 1e-12)
        values = {m: getattr(spectrum, m)[:, axis] * DEG for m in models}
        shown = np.concatenate([v[v > 0] for v in values.values()])
        bottom = 0.5 * min(float(shown.min()) if len(shown) else 1.0, float(noise.min()))
        ax.fill_between(spectrum.order, bottom, noise, color="#e3e7eb", lw=0)
        ax.plot(spectrum.order, noise, color=COLOURS["noise"], lw=0.9, label=LABELS["noise"])
        tops = np.maximum(values["declared"], bottom)
        ax.vlines(spectrum.order, bottom, tops, color=COLOURS["declared"], lw=1.0, alpha=0.5)
        for size, (model, y) in zip((4.5, 2.8), values.items(), strict=False):
            ax.plot(spectrum.order, y, "o", ms=size, color=COLOURS[model], label=LABELS[model])
        top = 2.0 * max(float(shown.max()) if len(shown) else 1.0, float(noise.max()))
        ax.set_yscale("log")
        ax.set_ylim(bottom, top)
        plain_log(ax.yaxis)
        name_axis(ax, axis)
    rows[-1].set_xlabel("order (multiple of the drive's frequency)")
    rows[-1].xaxis.set_major_locator(MaxNLocator(integer=True, nbins=11))
    drawing.supylabel("amplitude, deg/s", fontsize=8.5, color="#3a444f")
    legend(drawing, rows[0])
    return drawing


def ellipse(data: Ellipse, models: Models) -> Drawing:
    """Angular rate against acceleration along the rail over one mean period."""
    drawing, (ax,) = panels()
    ax.axhline(0, color="#8b95a1", lw=0.6)
    ax.axvline(0, color="#8b95a1", lw=0.6)
    ax.plot(data.acceleration, data.measured * DEG, "o", ms=3.2, mfc="none", mew=0.9, color="#5c6670", label="measured")
    for model in models:
        ax.plot(data.acceleration, getattr(data, model) * DEG, color=COLOURS[model], lw=1.7, label=LABELS[model])
    ax.set_xlabel("acceleration along the rail, m/s²")
    ax.set_ylabel(f"angular rate {data.axis}, deg/s")
    legend(drawing, ax)
    return drawing


def position(data: PositionMap, axes: Sequence[int], models: Models) -> Drawing:
    """Mean residual over position, forward and backward."""
    drawing, rows = panels(len(axes))
    for ax, axis in zip(rows, axes, strict=True):
        ax.axhline(0, color="#8b95a1", lw=0.6)
        for model in models:
            for side, (style, word) in enumerate((("-", "forward"), ("--", "backward"))):
                y = getattr(data, model)[side, :, axis] * DEG
                ax.plot(data.position * 1e3, y, style, color=COLOURS[model], lw=1.3, label=f"{LABELS[model]}, {word}")
        name_axis(ax, axis)
        ax.yaxis.set_major_locator(MaxNLocator(nbins=4))
    rows[-1].set_xlabel("position on the rail, mm")
    drawing.supylabel("mean residual, deg/s", fontsize=8.5, color="#3a444f")
    legend(drawing, rows[0], columns=2)
    return drawing
