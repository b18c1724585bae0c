"""The assessment as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gsense_rig.assessment.judging import PHASE_TARGET, RMS_TARGET
from gsense_rig.assessment.plants import NOMINAL

if TYPE_CHECKING:
    from gsense_rig.assessment.checks import Check
    from gsense_rig.assessment.judging import Judged
    from gsense_rig.assessment.sine_run import Tracking

Figures = dict[float, "Tracking"]


def tracking_table(pi: Figures, nominal: Judged, worst_untuned: Figures, worst_tuned: Figures) -> str:
    """Both controllers, the better one also at its worst over all plants."""
    lines = [
        "            PI of the thesis          feed-forward, tuned       worst plant, not tuned    worst plant, tuned",
        " rad/s     mm     deg   m/s^2       mm     deg   m/s^2       mm     deg   m/s^2       mm     deg   m/s^2",
    ]
    for w in pi:
        columns = [figures[w] for figures in (pi, nominal.tuned, worst_untuned, worst_tuned)]
        cells = [f"{f.rms * 1e3:8.3f} {f.phase:+7.3f} {f.shake:7.3f}" for f in columns]
        lines.append(f"{w:5.1f} " + "  ".join(cells))
    return "\n".join(lines)


def estimator_table(judged: Judged) -> str:
    """Errors of both estimators on one plant, tuned."""
    lines = [
        "         derivative and low-pass (best cut-off)          observer",
        " rad/s   cut-off Hz   mm/s   m/s^2   lag ms          mm/s   m/s^2   lag ms",
    ]
    for w, observer in judged.observer.items():
        thesis = judged.thesis[w]
        lines.append(
            f"{w:5.1f} {thesis.cutoff or 0.0:12.0f} {thesis.velocity * 1e3:8.2f} {thesis.acceleration:7.3f} "
            f"{thesis.velocity_lag:8.2f} {observer.velocity * 1e3:13.2f} {observer.acceleration:7.3f} "
            f"{observer.velocity_lag:8.2f}"
        )
    return "\n".join(lines)


def plant_table(judged: list[Judged]) -> str:
    """Each plant's worst figures over the frequencies."""
    width = max(len(j.plant) for j in judged)
    lines = [f"{'plant':{width}}   not tuned: mm    deg       tuned: mm    deg"]
    for j in judged:
        cells = [
            f"{max(f.rms for f in figures.values()) * 1e3:9.3f} {max(abs(f.phase) for f in figures.values()):6.3f}"
            for figures in (j.untuned, j.tuned)
        ]
        lines.append(f"{j.plant:{width}}   {cells[0]:>19}   {cells[1]:>19}")
    return "\n".join(lines)


def check_table(checks: list[Check]) -> str:
    """The simulated rail against the figures calculated for this drive."""
    width = max(len(check.name) for check in checks)
    return "\n".join(
        f"{c.name:{width}}  {c.value:8.3f} {c.unit:4} calculated {c.low:g} to {c.high:g}{'' if c.holds else '   OFF'}"
        for c in checks
    )


def document(pi: Figures, judged: list[Judged], untuned: Figures, tuned: Figures, checks: list[Check]) -> str:
    """Everything, with headings."""
    nominal = next(j for j in judged if j.plant == NOMINAL)
    heading = (
        f"Tracking at the encoder, 0.15 m: rms (target {RMS_TARGET * 1e3:g} mm), phase (target {PHASE_TARGET:g} deg), "
        "and what the accelerometer\nfeels beside the sine (44 Hz filter). PI and feed-forward on the plant as "
        f"believed; the worst of {len(judged)} plants."
    )
    parts = (
        heading,
        tracking_table(pi, nominal, untuned, tuned),
        "Velocity and acceleration against the carriage's truth (rms), tuned:",
        estimator_table(nominal),
        "The worst of each plant over the frequencies:",
        plant_table(judged),
        "The simulated rail against the figures calculated for this drive:",
        check_table(checks),
    )
    return "\n\n".join(parts)
