"""A finding's fitted curve over its data."""

from __future__ import annotations

from matplotlib.figure import Figure as Drawing

from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.report.figures.canvas import COLOURS, panels

MAX_PANELS = 3


def curve(data: Curve) -> Drawing:
    """Data as dots with the fitted curve, a panel a series."""
    count = data.measured.shape[1]
    drawing, rows = panels(min(count, MAX_PANELS))
    for ax, k in zip(rows, range(count), strict=False):
        ax.plot(data.x, data.measured[:, k], "o", ms=2.8, color="#5c6670", label="measured")
        ax.plot(data.x, data.fitted[:, k], color=COLOURS["full"], label="the finding")
        if data.series:
            ax.set_ylabel(data.series[k], rotation=0, weight="bold", va="center", labelpad=7)
    rows[-1].set_xlabel(data.x_label)
    drawing.supylabel(data.y_label, fontsize=8.5, color="#3a444f")
    handles, labels = rows[0].get_legend_handles_labels()
    drawing.legend(handles, labels, loc="outside upper left", ncols=2, handlelength=1.6)
    return drawing
