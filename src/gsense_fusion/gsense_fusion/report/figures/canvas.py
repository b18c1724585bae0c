"""What all figures share: size, colours, and a small SVG that is equal for equal input.

Text stays text (no glyph outlines): small, searchable, and sharp in print. Bag names never enter a figure; they may
hold anything, the page escapes them, and Matplotlib would read "$" as mathematics.
"""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from gsense_fusion.identification.types import AXES, FloatArray

COLOURS = {"raw": "#9aa5b1", "declared": "#d9730d", "full": "#1261a0", "noise": "#20262d", "temperature": "#b03060"}
"""Told apart by colour-blind readers too; the page's bars use the same."""
LABELS = {"raw": "bias alone", "declared": "declared model", "full": "with the findings", "noise": "noise floor"}
Models = tuple[str, ...]
"""Which of raw, declared and full a figure draws: without findings full is declared, and would only hide it."""
SIZE_IN = (4.7, 3.4)
MAX_POINTS = 700
MAX_LOG_TICKS = 5
STYLE: Any = {
    "svg.fonttype": "none",
    "font.family": ["sans-serif"],
    "font.size": 8.5,
    "axes.edgecolor": "#8b95a1",
    "axes.labelcolor": "#3a444f",
    "axes.labelsize": 8.5,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e8ec",
    "grid.linewidth": 0.6,
    "xtick.color": "#3a444f",
    "ytick.color": "#3a444f",
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "path.simplify": True,
    "axes.formatter.useoffset": False,
}


@dataclass(frozen=True)
class Figure:
    """One figure of the page."""

    key: str
    """Name in the page's anchors."""
    title: str
    how_to_read: str
    svg: str


def panels(rows: int = 1, heights: Sequence[float] | None = None, *, share_x: bool = True) -> tuple[Drawing, list[Any]]:
    """A drawing with its axes one below the other; call inside `mpl.rc_context(STYLE)`."""
    drawing = Drawing(figsize=SIZE_IN, layout="constrained")
    FigureCanvasSVG(drawing)
    grid = drawing.subplots(
        rows, 1, sharex=share_x, squeeze=False, gridspec_kw={"height_ratios": heights or [1.0] * rows}
    )
    return drawing, list(grid[:, 0])


def legend(drawing: Drawing, axes: Any, columns: int = 4) -> None:
    """A legend above the panels, from one panel's labelled artists."""
    handles, labels = axes.get_legend_handles_labels()
    drawing.legend(
        handles, labels, loc="outside upper left", ncols=columns, handlelength=1.6, columnspacing=1.3, borderaxespad=0.1
    )


def name_axis(axes: Any, axis: int) -> None:
    """The gyro axis beside its panel."""
    axes.set_ylabel(AXES[axis], rotation=0, weight="bold", va="center", labelpad=7)


def plain_log(axis: Any) -> None:
    """Plain numbers on a logarithmic axis whose limits stand; between the decades too where it spans few."""
    low, high = sorted(axis.get_view_interval())
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    ticks: list[float] = []
    for steps in ((1, 2, 3, 5, 7), (1, 2, 5), (1, 3), (1,)):
        ticks = [t for t in (float(f"{m}e{d}") for d in decades for m in steps) if low <= t <= high]
        if len(ticks) <= MAX_LOG_TICKS:
            break
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_locator(NullLocator())


def to_svg(drawing: Drawing, title: str, salt: str) -> str:
    """The drawing as an <svg> element without prologue, date and creator; `salt` keeps ids of figures apart."""
    buffer = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": salt}):
        drawing.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'<g id="[a-zA-Z]+[\w.]*_\d+">', "<g>", text)  # numbered ids would repeat from figure to figure
    text = re.sub(r"\n\s*", "\n", text)
    text = re.sub(r'(<svg[^>]*?) width="[^"]+pt"', r"\1", text, count=1)
    text = re.sub(r'(<svg[^>]*?) height="[^"]+pt"', r"\1", text, count=1)
    return text.replace("<svg ", f'<svg role="img" aria-label="{title}" ', 1)


def envelope(x: FloatArray, y: FloatArray, points: int = MAX_POINTS) -> tuple[FloatArray, FloatArray]:
    """Smallest and largest value of each of `points` / 2 stretches: long series look the same with few points."""
    if len(x) <= points:
        return x, y
    edges = np.linspace(0, len(x), points // 2 + 1).astype(int)
    keep: list[int] = []
    for start, stop in pairwise(edges.tolist()):
        part = y[start:stop]
        if np.isnan(part).all():
            keep.append(start)
        else:
            keep.extend(sorted({int(start + np.nanargmin(part)), int(start + np.nanargmax(part))}))
    return x[keep], y[keep]
