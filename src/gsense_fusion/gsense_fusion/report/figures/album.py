"""Which figures a result has, in the order of the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure as Drawing

from gsense_fusion.identification.result import LoopResult
from gsense_fusion.report.figures import drive, still, vertical
from gsense_fusion.report.figures.canvas import STYLE, Figure, to_svg
from gsense_fusion.report.words import has_motion

ALL_AXES = (0, 1, 2)


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
        with mpl.rc_context({**STYLE}):
            out.append(Figure(entry.key, entry.title, entry.how_to_read, to_svg(entry.draw(), entry.title, entry.key)))
    return tuple(out)


def _entries(result: LoopResult) -> Iterator[_Entry]:
    plots = result.plots
    moving = has_motion(result)
    if plots.per_run:
        yield _Entry(
            "per_run",
            "Error of every held-out run",
            "Blue should sit on the grey bar, the noise floor; orange above blue is what the declared model lacks.",
            lambda: drive.per_run(plots.per_run),
        )
    if plots.poses is not None and not moving:
        yield from _poses(result)
    yield from _drive_entries(result)
    if plots.slow is not None and len(plots.slow.time):
        data = plots.slow
        yield _Entry(
            "slow",
            "The bias over the session",
            "Means over blocks: grey that leaves both lines is drift; a line that follows grey with the temperature explains it.",
            lambda: still.slow(data, ALL_AXES),
        )
    if plots.spectrum_hz is not None and len(plots.spectrum_hz) and plots.spectrum:
        frequency = plots.spectrum_hz
        yield _Entry(
            "spectrum",
            "Residual spectrum against the noise model",
            "The fastest held-out run: blue should lie on black; a peak above it is something that no model here explains.",
            lambda: still.spectrum(frequency, plots.spectrum),
        )
    if plots.poses is not None and moving:
        yield from _poses(result)
    if plots.attitude is not None and len(plots.attitude.time):
        trace = plots.attitude
        yield _Entry(
            "attitude",
            "Attitude error over a run",
            f"Angle between true and estimated vertical in {trace.run}; lower is better. Curves that coincide hide each other: "
            "then this effect does not reach the attitude.",
            lambda: vertical.attitude(trace),
        )


def _drive_entries(result: LoopResult) -> Iterator[_Entry]:
    plots = result.plots
    if plots.orders is not None and len(plots.orders.order):
        spectrum = plots.orders
        yield _Entry(
            "orders",
            "Residual in orders of the drive",
            "What follows the carriage stands at whole orders: orange above the grey is unmodelled, blue should drop into it.",
            lambda: drive.orders(spectrum, tuple(i for i in ALL_AXES if np.any(spectrum.noise[:, i] > 0)) or ALL_AXES),
        )
    if plots.ellipse is not None and len(plots.ellipse.acceleration):
        data = plots.ellipse
        yield _Entry(
            "ellipse",
            "Gyro against acceleration over one period",
            f"{data.bag}, {data.angular_frequency:.3g} rad/s: g-sensitivity is a line through the dots. An open loop is a shift in "
            "phase, which no polynomial in the acceleration can follow.",
            lambda: drive.ellipse(data),
        )
    if plots.position is not None and len(plots.position.position):
        where = plots.position
        yield _Entry(
            "position",
            "Residual over position and direction",
            f"{where.bag}: forward and backward mirrored means it follows velocity (a bent rail, pick-up); both alike means it "
            "follows position or acceleration. Blue should be flat.",
            lambda: drive.position(where, ALL_AXES),
        )


def _poses(result: LoopResult) -> Iterator[_Entry]:
    data = result.plots.poses
    if data is not None and len(data.raw):
        yield _Entry(
            "poses",
            "Still stretches before and after",
            "Each dot is one still stretch, predicted by a model that did not see it: a slope is g-sensitivity, blue should be flat.",
            lambda: still.poses(data, ALL_AXES),
        )
