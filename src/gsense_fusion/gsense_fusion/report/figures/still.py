"""Figures of slow things: the bias over the session, still stretches, the residual's spectrum."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure as Drawing
from matplotlib.ticker import MaxNLocator

from gsense_fusion.identification.result import PoseScatter, SlowTrace
from gsense_fusion.identification.types import FloatArray
from gsense_fusion.report.figures.canvas import COLOURS, LABELS, Models, legend, name_axis, panels, plain_log
from gsense_fusion.report.units import DEG

LOG_BINS = 260
SPECTRUM_LABELS = {**LABELS, "noise": "noise model"}


def slow(data: SlowTrace, axes: Sequence[int], models: Models) -> Drawing:
    """Block means over the session with both models, and the temperature below."""
    warm = data.temperature is not None
    drawing, rows = panels(len(axes) + warm)
    long = float(np.ptp(data.time)) > 300.0
    time = (data.time - data.time.min()) / (60.0 if long else 1.0)
    for ax, axis in zip(rows, axes, strict=False):
        ax.plot(time, data.measured[:, axis] * DEG, "o", ms=2.8, color="#5c6670", label="measured")
        for model in models:
            ax.plot(time, getattr(data, model)[:, axis] * DEG, color=COLOURS[model], lw=1.2, label=LABELS[model])
        name_axis(ax, axis)
        ax.yaxis.set_major_locator(MaxNLocator(nbins=4))
    if data.temperature is not None:
        rows[-1].plot(time, data.temperature, "o-", ms=2.4, lw=0.9, color=COLOURS["temperature"])
        rows[-1].set_ylabel("°C")
        rows[-1].yaxis.set_major_locator(MaxNLocator(nbins=4))
    rows[-1].set_xlabel("time in the session, min" if long else "time in the session, s")
    drawing.supylabel("mean rate, deg/s", fontsize=8.5, color="#3a444f")
    legend(drawing, rows[0])
    return drawing


def poses(data: PoseScatter, axes: Sequence[int], models: Models) -> Drawing:
    """Mean rate of still stretches against the specific force in the direction that the axis follows most."""
    drawing, rows = panels(len(axes))
    for ax, axis in zip(rows, axes, strict=True):
        x = data.specific_force @ _direction(data.specific_force, data.raw[:, axis])
        ax.axhline(0, color="#8b95a1", lw=0.6)
        for model, size in zip(models, (5.5, 4.0, 3.2), strict=False):
            ax.plot(x, getattr(data, model)[:, axis] * DEG, "o", ms=size, color=COLOURS[model], label=LABELS[model])
        name_axis(ax, axis)
        ax.yaxis.set_major_locator(MaxNLocator(nbins=4))
    rows[-1].set_xlabel("specific force in the direction that the axis follows most, m/s²")
    drawing.supylabel("mean rate, bias removed, deg/s", fontsize=8.5, color="#3a444f")
    legend(drawing, rows[0])
    return drawing


def _direction(force: FloatArray, rate: FloatArray) -> FloatArray:
    """Unit vector, shape (3,), along which a rate (s,) changes with the force (s, 3); x where it does not change."""
    beta, *_ = np.linalg.lstsq(force - force.mean(axis=0), rate - rate.mean(), rcond=1e-6)
    size = float(np.linalg.norm(beta))
    return np.asarray(beta / size) if size > 0 and np.isfinite(size) else np.array([1.0, 0.0, 0.0])


def spectrum(frequency: FloatArray, densities: Mapping[str, FloatArray], models: Models) -> Drawing:
    """Amplitude spectral density of the residual against the noise model."""
    drawing, (ax,) = panels()
    for name in (*models, "noise"):
        if name in densities:
            f, y = _log_binned(frequency, densities[name] * DEG)
            ax.loglog(f, y, color=COLOURS[name], lw=1.4 if name == "noise" else 1.0, label=SPECTRUM_LABELS[name])
    ax.axvline(5.0, color="#8b95a1", lw=0.8, ls=":")
    ax.set_xlabel("frequency, Hz (dotted: the 5 Hz of the error figures)")
    ax.set_ylabel("residual, deg/s/√Hz, axes summed")
    plain_log(ax.xaxis)
    plain_log(ax.yaxis)
    legend(drawing, ax)
    return drawing


def _log_binned(frequency: FloatArray, density: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Root mean square in bins of equal width on a logarithmic axis; lines at low frequencies stay lines."""
    good = (frequency > 0) & np.isfinite(density) & (density > 0)
    f, y = frequency[good], density[good]
    if len(f) <= LOG_BINS:
        return f, y
    edges = np.geomspace(f[0], f[-1], LOG_BINS + 1)
    index = np.clip(np.digitize(f, edges) - 1, 0, LOG_BINS - 1)
    count = np.bincount(index, minlength=LOG_BINS)
    used = count > 0
    mean_f = np.bincount(index, f, LOG_BINS)[used] / count[used]
    mean_power = np.bincount(index, y**2, LOG_BINS)[used] / count[used]
    return mean_f, np.sqrt(mean_power)
