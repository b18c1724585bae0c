"""Figure of the attitude error over one held-out run."""

from __future__ import annotations

from matplotlib.figure import Figure as Drawing

from gsense_fusion.identification.errors.metrics import AttitudeTrace
from gsense_fusion.report.figures.canvas import COLOURS, LABELS, Models, envelope, legend, panels
from gsense_fusion.report.units import DEG


def attitude(trace: AttitudeTrace, models: Models) -> Drawing:
    """Angle between the true and the estimated vertical, gyro alone and through Madgwick's filter."""
    drawing, rows = panels(2)
    for ax, kind, title in zip(rows, ("gyro_only", "madgwick"), ("gyro alone", "Madgwick"), strict=True):
        series = getattr(trace, kind)
        for model, width in zip(models, (2.6, 1.5, 1.0), strict=False):
            t, y = envelope(trace.time, series[model] * DEG)
            ax.plot(t, y, color=COLOURS[model], lw=width, label=LABELS[model])
        ax.set_ylim(bottom=0)
        ax.set_ylabel(f"{title}, deg")
    rows[-1].set_xlabel("time in the run, s")
    legend(drawing, rows[0])
    return drawing
