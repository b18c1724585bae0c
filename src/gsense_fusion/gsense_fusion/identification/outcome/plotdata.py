"""Arrays behind the report's figures, from held-out runs wherever there are any."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gsense_fusion.identification.analysis import Analysis
from gsense_fusion.identification.campaign import RunData, Window
from gsense_fusion.identification.errors.metrics import (
    MIN_STILL_STRETCHES,
    RATE_BAND_HZ,
    AttitudeTrace,
    Held,
    band_rms,
    noise_floor,
    residual_runs,
)
from gsense_fusion.identification.errors.predict import Prediction
from gsense_fusion.identification.likelihood.slow import Drift
from gsense_fusion.identification.noise.spectrum import periodogram
from gsense_fusion.identification.result import Ellipse, OrderSpectrum, PoseScatter, PositionMap, RunErrors, SlowTrace
from gsense_fusion.identification.types import AXES, FloatArray
from gsense_fusion.identification.verdict.residual import residuals
from gsense_fusion.identification.verdict.sufficiency import order_energy

PHASE_BINS = 72
POSITION_BINS = 40


def per_run(a: Analysis, rest: Mapping[int, Drift]) -> tuple[RunErrors, ...]:
    """Held-out error of each run; `rest`: drift at rest, by axis."""
    out = []
    for fold in a.folds:
        for data in fold.held:
            one = [Held((data,), fold.everything, fold.models, fold.predictor)]
            w = None if data.motion is None else data.motion.angular_frequency
            raw, declared, full = (band_rms(one, m, RATE_BAND_HZ) for m in ("raw", "declared", "full"))
            floor = noise_floor(one, a.noise, rest)
            out.append(RunErrors(data.run.name, w, raw, declared, full, floor))
    return tuple(sorted(out, key=lambda e: e.angular_frequency or 0.0))


def moving(a: Analysis) -> list[tuple[Held, RunData, Window]]:
    """Held-out windows in steady motion."""
    return [
        (fold, data, w)
        for fold in a.folds
        for data in fold.held
        for w in data.windows
        if w.moving and data.motion is not None and data.motion.angular_frequency is not None
    ]


def _fastest(a: Analysis) -> tuple[Held, RunData, Window] | None:
    return max(moving(a), key=lambda x: x[1].motion.angular_frequency or 0.0, default=None)  # type: ignore[union-attr]


def orders(a: Analysis) -> OrderSpectrum | None:
    """Residual amplitude at half-orders of the drive before and after."""
    runs = [data for _, data, _ in moving(a)]
    if not runs:
        return None
    amplitude = []
    for fit in (a.claims.ladder["declared"], a.claims.full):
        windows = [w for w in residuals(a.likelihood, fit, runs) if w.window.moving]
        amplitude.append(order_energy(windows))
    noise = np.zeros((len(amplitude[0].order), 3))
    for axis, model in a.noise.items():
        # expected squared amplitude of noise alone: 4 S / (2 T) ... two quadratures of variance S / T each
        parts = [
            2 * model.psd(amplitude[0].order * w.angular_frequency / (2 * np.pi)) * w.resolution_hz
            for w in windows
            if w.angular_frequency is not None
        ]
        noise[:, axis] = np.sqrt(np.mean(parts, axis=0))
    before, after = (np.sqrt(e.amplitude_squared) for e in amplitude)
    return OrderSpectrum(amplitude[0].order, before, after, noise)


def _by_phase(data: RunData, window: Window, series: FloatArray) -> FloatArray:
    """Mean of (n, k) over the drive's phase, shape (PHASE_BINS, k)."""
    w = 0.0 if data.motion is None else data.motion.angular_frequency or 0.0
    t = data.run.time[window.start : window.stop] - data.delay_s
    bins = ((w * t / (2 * np.pi)) % 1.0 * PHASE_BINS).astype(int) % PHASE_BINS
    count = np.bincount(bins, minlength=PHASE_BINS)
    out = [np.bincount(bins, series[:, i], PHASE_BINS) / np.maximum(count, 1) for i in range(series.shape[1])]
    return np.stack(out, axis=1)


def ellipse(a: Analysis) -> Ellipse | None:
    """Gyro against acceleration in the fastest held-out run, on the axis with the largest swing."""
    found = _fastest(a)
    if found is None:
        return None
    fold, data, window = found
    cut = slice(window.start, window.stop)
    kin = a.likelihood.source.of(data, a.claims.ladder["declared"].templates).kinematics
    measured = data.run.angular_rate[cut] - data.run.angular_rate[cut].mean(axis=0)
    predictions = []
    for label in ("declared", "full"):
        rate = fold.predictor.rate(data, fold.models[label])[cut]
        predictions.append(rate - rate.mean(axis=0))
    mean = [_by_phase(data, window, x) for x in (measured, *predictions)]
    acceleration = _by_phase(data, window, kin.acceleration[cut, None])[:, 0]
    axis = int(np.argmax(np.ptp(mean[0], axis=0)))
    w = 0.0 if data.motion is None else data.motion.angular_frequency or 0.0
    closed = [np.append(m[:, axis], m[0, axis]) for m in mean]
    return Ellipse(data.run.name, w, AXES[axis], np.append(acceleration, acceleration[0]), *closed)


def position_map(a: Analysis) -> PositionMap | None:
    """Mean residual over position, forward and backward, in the fastest held-out run."""
    found = _fastest(a)
    if found is None:
        return None
    fold, data, window = found
    cut = slice(window.start, window.stop)
    kin = a.likelihood.source.of(data, a.claims.full.templates).kinematics
    position, forward = kin.position[cut], kin.velocity[cut] > 0
    edges = np.linspace(position.min(), position.max(), POSITION_BINS + 1)
    bins = np.clip(np.digitize(position, edges) - 1, 0, POSITION_BINS - 1)
    maps = []
    for label in ("declared", "full"):
        error = residual_runs(fold, fold.models[label])[data][cut]
        out = np.full((2, POSITION_BINS, 3), np.nan)
        for side, mask in enumerate((forward, ~forward)):
            count = np.bincount(bins[mask], minlength=POSITION_BINS)
            for axis in range(3):
                total = np.bincount(bins[mask], error[mask, axis], POSITION_BINS)
                out[side, :, axis] = np.where(count > 0, total / np.maximum(count, 1), np.nan)
        maps.append(out)
    return PositionMap(data.run.name, (edges[:-1] + edges[1:]) / 2, maps[0], maps[1])


def slow_trace(a: Analysis) -> SlowTrace | None:
    """Block means of the fit runs over the session."""
    blocks = a.likelihood.blocks
    if len(blocks) < 3 or not any(r.has_rig for r in a.clean):
        return None
    predicted = []
    for fit in (a.claims.ladder["declared"], a.claims.full):
        p = a.likelihood.block_columns(fit.templates, fit.names) @ fit.beta
        predicted.append(p - p.mean(axis=0) + blocks.rate.mean(axis=0))
    runs = a.campaign.fit
    temperature = None
    if all(r.run.temperature is not None for r in runs):
        values = [runs[n].run.temperature[w.start : w.stop].mean() for n, w in a.likelihood.cuts]  # type: ignore[index]
        temperature = np.array(values)
    return SlowTrace(blocks.time, blocks.rate, predicted[0], predicted[1], temperature)


def pose_scatter(a: Analysis) -> PoseScatter | None:
    """Means of the held-out still stretches."""
    force: list[FloatArray] = []
    means: dict[str, list[FloatArray]] = {m: [] for m in ("raw", "declared", "full")}
    for fold in a.folds:
        for label, out in means.items():
            for data, error in residual_runs(fold, fold.models[label]).items():
                for w in data.windows:
                    if not w.moving:
                        out.append(error[w.start : w.stop].mean(axis=0))
                        if label == "raw":
                            force.append(data.run.specific_force[w.start : w.stop].mean(axis=0))
    if len(force) < MIN_STILL_STRETCHES:
        return None
    return PoseScatter(np.array(force), *(np.array(means[m]) for m in ("raw", "declared", "full")))


def spectra(a: Analysis) -> dict[str, Any]:
    """Amplitude spectral density of the fastest held-out run's residual, axes summed, and the noise model's."""
    found = _fastest(a)
    if found is None:
        return {}
    fold, data, window = found
    cut = slice(window.start, window.stop)
    out: dict[str, FloatArray] = {}
    frequency: FloatArray = np.zeros(0)
    models: dict[str, Prediction] = {m: fold.models[m] for m in ("declared", "full")}
    for label, model in models.items():
        error = residual_runs(fold, model)[data][cut]
        grams = [periodogram(error[:, axis], data.run.rate_hz) for axis in a.noise]
        frequency = grams[0].frequency
        out[label] = np.sqrt(np.sum([g.power for g in grams], axis=0))
    out["noise"] = np.sqrt(np.sum([m.psd(frequency) for m in a.noise.values()], axis=0))
    return {"spectrum_hz": frequency, "spectrum": out}


def worst_attitude(traces: Sequence[AttitudeTrace]) -> AttitudeTrace | None:
    """The run in which the gyro alone errs most."""
    return max(traces, key=lambda t: float(np.mean(t.gyro_only["raw"] ** 2)), default=None)
