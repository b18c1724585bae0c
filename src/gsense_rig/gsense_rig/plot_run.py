"""`plot_run BAG --out FILE.png [--sensor mpu6050]`: a picture of a run.

Reference and encoder, tracking error, accelerometer and gyro; the whole run and two seconds of it.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from rich.console import Console

from gsense_driver.user_input.arguments import ArgumentParser
from gsense_rig.recording.run_columns import RunColumns, RunError, read_columns
from gsense_rig.recording.typestore import DefinitionError, typestore

UNUSABLE = 2
DETAIL = 2.0
"""s in the right column."""
_COLOURS = ("#c0392b", "#2e7d32", "#1f5fa8")


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit 0; 2 with one line where the bag cannot be shown or the file not written."""
    parser = ArgumentParser(prog="plot_run", description=__doc__)
    parser.add_argument("bag", type=Path, metavar="BAG", help="folder of a run")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help=".png, .pdf or .svg")
    parser.add_argument("--sensor", default="mpu6050", metavar="NAME", help="of the bag's sensors (default: mpu6050)")
    parser.add_argument("--detail", type=float, metavar="S", help="begin of the right column, s (default: the middle)")
    options = parser.parse_args(arguments)
    if not options.out.parent.is_dir():
        return _unusable(f"{options.out.parent}: no such folder")
    try:
        run = read_columns(options.bag, options.sensor, typestore())
        figure = draw(run, options.detail)
        temporary = options.out.with_name(f".{options.out.name}")
        figure.savefig(temporary, format=options.out.suffix.lstrip(".") or "png", dpi=80)
        temporary.replace(options.out)
    except (RunError, DefinitionError, ValueError, OSError) as error:
        return _unusable(error)
    Console(highlight=False, soft_wrap=True).print(str(options.out))
    return 0


def _unusable(why: object) -> int:
    Console(stderr=True, highlight=False, soft_wrap=True, markup=False).print(f"plot_run: {why}")
    return UNUSABLE


def draw(run: RunColumns, detail: float | None = None) -> Figure:
    """The picture; `detail` is where its right column begins, s."""
    figure = Figure(figsize=(10.0, 8.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(4, 2, sharex="col", width_ratios=(3, 2))
    middle = float(run.pose[-1, 0]) / 2.0
    begin = middle if detail is None else detail
    for column, (low, high) in enumerate(((0.0, float(run.pose[-1, 0])), (begin, begin + DETAIL))):
        _draw_column(axes[:, column], run, low, high)
    for row, label in enumerate(("position (mm)", "error (mm)", "specific force\nless mean (m/s²)", "rate (°/s)")):
        axes[row, 0].set_ylabel(label)
    figure.suptitle(f"{run.name}: encoder and {run.sensor}", fontsize=11)
    return figure


def _draw_column(axes: Any, run: RunColumns, low: float, high: float) -> None:
    pose, state, imu = (table[(table[:, 0] >= low) & (table[:, 0] <= high)] for table in (run.pose, run.state, run.imu))
    mean = run.imu[:, 4:].mean(axis=0)
    axes[0].plot(pose[:, 0], pose[:, 1] * 1e3, color=_COLOURS[2], linewidth=1.4, label="encoder")
    axes[0].plot(state[:, 0], state[:, 1] * 1e3, color="black", linewidth=0.7, linestyle="--", label="reference")
    axes[1].plot(state[:, 0], state[:, 2] * 1e3, color=_COLOURS[0], linewidth=0.8)
    for axis, name in enumerate("xyz"):
        axes[2].plot(imu[:, 0], imu[:, 4 + axis] - mean[axis], color=_COLOURS[axis], linewidth=0.7, label=name)
        axes[3].plot(imu[:, 0], np.degrees(imu[:, 1 + axis]), color=_COLOURS[axis], linewidth=0.7, label=name)
    for panel in axes:
        panel.grid(alpha=0.3)
        panel.margins(x=0.01)
    for panel in (axes[0], axes[3]):
        panel.margins(y=0.3)  # room for the legend
        panel.legend(loc="upper right", fontsize=8, ncols=3, framealpha=0.9)
    axes[3].set_xlabel("time (s)")


if __name__ == "__main__":
    sys.exit(main())
