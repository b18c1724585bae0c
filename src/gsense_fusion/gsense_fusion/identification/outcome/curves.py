"""Each claimed effect's fitted curve over its data: the residual of the full model with the effect put back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gsense_fusion.identification.analysis import Analysis
from gsense_fusion.identification.campaign import RunData, Window
from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.errors.metrics import Held, residual_runs
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.types import AXES, FloatArray

PHASE_BINS = 72
MIN_BLOCKS = 4


def fitted_curves(a: Analysis, moving: Sequence[tuple[Held, RunData, Window]]) -> dict[str, Curve]:
    """By effect: over the drive's phase where the motion drives it, else over the session.

    Args:
        a: The analysis.
        moving: Held-out windows in motion.

    """
    out: dict[str, Curve] = {}
    for name in a.claims.names:
        effect = a.selection.effects[name]
        curve = _by_phase(a, effect, moving) if effect.dynamic and moving else _over_session(a, effect)
        if curve is not None:
            out[name] = curve
    return out


def _names(a: Analysis, effect: Effect) -> frozenset[str]:
    return a.selection.with_parts({effect.name})


def _by_phase(a: Analysis, effect: Effect, moving: Sequence[tuple[Held, RunData, Window]]) -> Curve | None:
    """In the held-out run in which the effect is largest."""
    best: tuple[float, RunData, FloatArray, FloatArray] | None = None
    for fold, data, window in moving:
        cut = slice(window.start, window.stop)
        model = fold.models["full"]
        part = fold.predictor.part(data, model, _names(a, effect), effect.templates)[cut]
        part = part - part.mean(axis=0)
        size = float(np.sqrt(np.mean(part**2)))
        if best is None or size > best[0]:
            error = residual_runs(fold, model)[data][cut]
            phase = _phase(data, data.run.time[cut])
            measured = _binned(phase, error - error.mean(axis=0) + part)
            best = size, data, measured, _binned(phase, part)
    if best is None or best[0] == 0.0:
        return None
    _, data, measured, fitted = best
    w = 0.0 if data.motion is None else data.motion.angular_frequency or 0.0
    return Curve(
        x=(np.arange(PHASE_BINS) + 0.5) * 360.0 / PHASE_BINS,
        measured=np.degrees(measured),
        fitted=np.degrees(fitted),
        series=AXES,
        x_label="phase of the drive, deg (0: through the centre, forward)",
        y_label="rate, deg/s",
        how_to_read=f"{data.run.name}, {w:.3g} rad/s, held out, mean over the periods: dots are the gyro less all else "
        "in the model, the curve is the finding; dots that leave the curve are of another shape.",
    )


def _phase(data: RunData, time: FloatArray) -> FloatArray:
    """Of the drive, 0 to 1, from the carriage's pass through the centre forward."""
    assert data.motion is not None  # noqa: S101  (windows in motion have one)
    w = data.motion.angular_frequency or 1.0
    t = time - data.delay_s
    kinematics = data.motion.at(t)
    weight = np.exp(-1j * w * t)
    # position s = A sin(w t + p): its first harmonic tells p
    p = float(np.angle(1j * np.mean((kinematics.position - kinematics.position.mean()) * weight)))
    return np.asarray(((w * t + p) / (2 * np.pi)) % 1.0)


def _binned(phase: FloatArray, series: FloatArray) -> FloatArray:
    bins = (phase * PHASE_BINS).astype(int) % PHASE_BINS
    count = np.maximum(np.bincount(bins, minlength=PHASE_BINS), 1)
    return np.stack([np.bincount(bins, s, PHASE_BINS) / count for s in series.T], axis=1)


def _over_session(a: Analysis, effect: Effect) -> Curve | None:
    """Block means over the session, in the runs that were fitted."""
    blocks, full = a.likelihood.blocks, a.claims.full
    if len(blocks) < MIN_BLOCKS:
        return None
    X = a.likelihood.block_columns(full.templates, full.names)
    mine = np.isin(np.arange(X.shape[2]), a.likelihood.columns.index(_names(a, effect)))
    fitted = X @ np.where(mine, full.beta, 0.0)
    if not fitted.any():
        return None
    measured = blocks.rate - X @ np.where(mine, 0.0, full.beta)
    order = np.argsort(blocks.time, kind="stable")
    centre = measured.mean(axis=0) - fitted.mean(axis=0)
    return Curve(
        x=(blocks.time[order] - blocks.time.min()) / 60.0,
        measured=np.degrees((measured - centre)[order]),
        fitted=np.degrees(fitted[order]),
        series=AXES,
        x_label="time in the session, min",
        y_label="rate, deg/s",
        how_to_read="Means over blocks of the runs that were fitted: dots are the gyro less all else in the model, "
        "the line is the finding; what leaves it slowly is drift.",
    )
