"""Which figures a result has, in the order of the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure as Drawing

from gsense_fusion.identification.result import LoopResult, PoseScatter
from gsense_fusion.report.figures import drive, fitted, still, vertical
from gsense_fusion.report.figures.canvas import STYLE, Figure, Models, to_svg
from gsense_fusion.report.words import has_motion

ALL_AXES = (0, 1, 2)
POSES_DIFFER = 1.0
"""m/s^2."""


@dataclass(frozen=True)
class _Entry:
    key: str
    title: str
    how_to_read: str
    draw: Callable[[], Drawing]


def figures(result: LoopResult) -> tuple[Figure, ...]:
    """All figures that the result has data for."""
    out = []
    for entry in _entries(result):
        with mpl.rc_context(STYLE):
            out.append(Figure(entry.key, entry.title, entry.how_to_read, to_svg(entry.draw(), entry.title, entry.key)))
    return tuple(out)


def _entries(result: LoopResult) -> Iterator[_Entry]:
    models: Models = ("declared", "full") if result.findings else ("declared",)
    moving = has_motion(result)
    yield from _errors(result, ("raw", *models))
    if not moving:
        yield from _poses(result, ("raw", *models))
    yield from _curves(result)
    yield from _locked(result, models)
    yield from _slow(result, models)
    if moving:
        yield from _poses(result, ("raw", *models))
        yield from _attitude(result, ("raw", *models))


def _best(models: Models) -> str:
    """Colour of the best model."""
    return "blue" if "full" in models else "orange"


def _errors(result: LoopResult, models: Models) -> Iterator[_Entry]:
    errors = result.plots.per_run
    if errors:
        text = (
            "Blue should sit on the grey bar, the noise floor; orange above blue is what the declared model lacks."
            if "full" in models
            else "Orange on the grey bar, the noise floor, is complete; orange above it is what no model here explains."
        )
        yield _Entry("per_run", "Error of every held-out run", text, lambda: drive.per_run(errors, models))


def _curves(result: LoopResult) -> Iterator[_Entry]:
    """Each finding's fitted curve over its data."""
    for name, data in result.plots.curves.items():
        draw = partial(fitted.curve, data)
        yield _Entry(name, f"{name}: data and fitted curve", data.how_to_read, draw)


def _locked(result: LoopResult, models: Models) -> Iterator[_Entry]:
    """What follows the carriage."""
    plots = result.plots
    if plots.orders is not None and len(plots.orders.order):
        spectrum = plots.orders
        axes = tuple(i for i in ALL_AXES if np.any(spectrum.noise[:, i] > 0)) or ALL_AXES
        text = "What follows the carriage stands at whole orders: orange above the grey noise is not modelled"
        text += "; blue should drop into it." if "full" in models else "."
        yield _Entry("orders", "Residual in orders of the drive", text, lambda: drive.orders(spectrum, axes, models))
    if plots.ellipse is not None and len(plots.ellipse.acceleration):
        loop = plots.ellipse
        text = f"{loop.bag}, {loop.angular_frequency:.3g} rad/s: g-sensitivity is a straight line, a bend is a power "
        text += "of the acceleration, an open loop is a shift in phase, which no polynomial can follow."
        yield _Entry("ellipse", "Gyro against acceleration over one period", text, lambda: drive.ellipse(loop, models))
    if plots.position is not None and len(plots.position.position):
        where = plots.position
        text = (
            f"{where.bag}: forward and backward mirrored follows velocity (a bent rail, pick-up), both alike follows "
        )
        text += f"position or acceleration; {_best(models)} should be flat."
        title = "Residual over position and direction"
        yield _Entry("position", title, text, lambda: drive.position(where, ALL_AXES, models))


def _slow(result: LoopResult, models: Models) -> Iterator[_Entry]:
    """The bias over the session, and the spectrum."""
    plots = result.plots
    if plots.slow is not None and len(plots.slow.time):
        trace = plots.slow
        text = "Dots are means over blocks, lines the models: what leaves the lines is drift, or a cause not modelled."
        yield _Entry("slow", "The bias over the session", text, lambda: still.slow(trace, ALL_AXES, models))
    if plots.spectrum_hz is not None and len(plots.spectrum_hz) and plots.spectrum:
        frequency, known = plots.spectrum_hz, tuple(m for m in models if m in plots.spectrum)
        text = f"The fastest held-out run: {_best(models)} should lie on black; a peak above it is not modelled."
        title = "Residual spectrum against the noise model"
        yield _Entry("spectrum", title, text, lambda: still.spectrum(frequency, plots.spectrum, known))


def _attitude(result: LoopResult, models: Models) -> Iterator[_Entry]:
    trace = result.plots.attitude
    if trace is not None and len(trace.time):
        text = f"Angle between true and estimated vertical in {trace.run}; lower is better. Where curves lie on each "
        text += "other, the models differ in the rate but not in the attitude."
        known = tuple(m for m in models if m in trace.gyro_only and m in trace.madgwick)
        yield _Entry("attitude", "Attitude error over a run", text, lambda: vertical.attitude(trace, known))


def _poses(result: LoopResult, models: Models) -> Iterator[_Entry]:
    data = result.plots.poses
    if data is not None and _poses_differ(data):
        text = "Each dot is one still stretch, predicted by a model that did not see it: a slope is g-sensitivity; "
        text += f"{_best(models)} should be flat."
        yield _Entry("poses", "Still stretches before and after", text, lambda: still.poses(data, ALL_AXES, models))


def _poses_differ(data: PoseScatter) -> bool:
    """Whether the stretches lie in distinct poses; one pose shows nothing of g-sensitivity."""
    return len(data.specific_force) > 1 and bool(np.ptp(data.specific_force, axis=0).max() > POSES_DIFFER)
