"""The tracking table as a picture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from gsense_rig.assessment.judging import PHASE_TARGET, RMS_TARGET

if TYPE_CHECKING:
    from pathlib import Path

    from gsense_rig.assessment.sine_run import Tracking

STYLE = (
    ("PI of the thesis", "#b2182b", "o"),
    ("feed-forward, tuned", "#2166ac", "o"),
    ("worst plant, not tuned", "#92c5de", "s"),
    ("worst plant, tuned", "#4393c3", "^"),
)
PANELS = ("rms of the tracking error, mm", "phase error, deg", "felt beside the sine, m/s² rms")
TARGETS = (RMS_TARGET * 1e3, PHASE_TARGET, None)


def _values(f: Tracking) -> tuple[float, float, float]:
    return f.rms * 1e3, max(abs(f.phase), 1e-4), f.shake


def save(path: Path, series: tuple[dict[float, Tracking], ...], plants: int) -> None:
    """Write a PNG: rms, phase and shake over the angular frequency, for the four columns of the tracking table."""
    figure = Figure(figsize=(11.0, 3.9), layout="constrained")
    for k, axes in enumerate(figure.subplots(1, 3)):
        for figures, (name, colour, marker) in zip(series, STYLE, strict=True):
            values = [_values(f)[k] for f in figures.values()]
            axes.semilogy(list(figures), values, marker=marker, color=colour, label=name)
        target = TARGETS[k]
        if target is not None:
            axes.axhline(target, color="0.4", linestyle="--", linewidth=1.0, label="target")
        axes.set_xlabel("angular frequency, rad/s")
        axes.set_title(PANELS[k], fontsize=10, loc="left")
        axes.grid(visible=True, which="major", alpha=0.3)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=len(labels), fontsize=8, frameon=False)
    figure.suptitle(f"0.15 m on the simulated rail; worst of {plants} plants with parameters 20 % off", fontsize=10)
    temporary = path.with_suffix(".part.png")
    figure.savefig(temporary, dpi=110)
    temporary.replace(path)
