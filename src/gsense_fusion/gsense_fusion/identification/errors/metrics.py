"""Errors before and after on held-out runs, as the interface contract defines them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft, rfftfreq

from gsense_fusion.attitude import Madgwick, MadgwickParameters, attitude_at_rest
from gsense_fusion.identification.campaign import RunData, Window
from gsense_fusion.identification.errors.predict import Prediction, Predictor
from gsense_fusion.identification.likelihood.slow import Blocks, Drift, SlowNoise
from gsense_fusion.identification.motion.harmonics import least_squares
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import FloatArray, Owner

RATE_BAND_HZ = 5.0
MIN_STILL_STRETCHES = 6

SHOWN = ("raw", "declared", "full")
"""Models whose errors are shown side by side."""
NOT_RIG = frozenset({Owner.SENSOR, Owner.MOUNT, Owner.CHAIN})


@dataclass(frozen=True)
class Rms:
    """Root mean squares of one kind of error for the three models, and what noise alone would leave."""

    raw: float
    declared: float
    full: float
    noise_floor: float | None = None


@dataclass(frozen=True, eq=False)
class Held:
    """Held-out runs with the models that did not see them, and all runs (for the sessions' biases)."""

    held: tuple[RunData, ...]
    everything: tuple[RunData, ...]
    models: Mapping[str, Prediction]
    """raw, declared, full."""
    predictor: Predictor


def band_square(series: FloatArray, rate_hz: float, cutoff_hz: float) -> float:
    """Sum of squares of a run's series (n, k) after a zero-phase brick wall, by Parseval's theorem."""
    n = len(series)
    power = np.abs(rfft(np.ascontiguousarray(series.T), axis=1)) ** 2
    power[:, 1 : (n + 1) // 2] *= 2.0
    return float(np.sum(power[:, rfftfreq(n, 1 / rate_hz) <= cutoff_hz])) / n


def residual_runs(fold: Held, model: Prediction) -> dict[RunData, FloatArray]:
    """Measured minus predicted minus the session's bias of each held-out run, shape (n, 3)."""
    bias = fold.predictor.biases(fold.everything, model)
    return {r: fold.predictor.without(r, model) - bias[r.run.session] for r in fold.held}


def band_rms(folds: Sequence[Held], model: str, cutoff_hz: float) -> float:
    """Root mean square over all samples and axes of all held-out runs after the low-pass, rad/s."""
    total, count = 0.0, 0
    for fold in folds:
        for data, error in residual_runs(fold, fold.models[model]).items():
            axes = list(data.run.axes)
            total += band_square(error[:, axes], data.run.rate_hz, cutoff_hz)
            count += len(error) * len(axes)
    return float(np.sqrt(total / max(count, 1)))


def pose_rms(folds: Sequence[Held], model: str) -> float | None:
    """The same over the means of held-out still stretches; None for fewer than six."""
    means: list[FloatArray] = []
    for fold in folds:
        for data, error in residual_runs(fold, fold.models[model]).items():
            axes = list(data.run.axes)
            means.extend(error[w.start : w.stop, axes].mean(axis=0) for w in data.windows if not w.moving)
    if len(means) < MIN_STILL_STRETCHES:
        return None
    return float(np.sqrt(np.mean(np.concatenate(means) ** 2)))


def noise_floor(
    folds: Sequence[Held], noise: Mapping[int, NoiseModel], drift: Mapping[int, Drift], cutoff_hz: float = RATE_BAND_HZ
) -> float:
    """What `band_rms` would be if the model were complete, from the noise model and the drift of the bias."""
    total, count = 0.0, 0
    for fold in folds:
        pieces = _pieces(fold.everything)
        for axis, model in noise.items():
            slow = SlowNoise(pieces, model.psd(np.array([0.5]))[0])
            K = slow.covariance(drift[axis])
            for data in fold.held:
                n, rate = len(data.run), data.run.rate_hz
                f = np.fft.rfftfreq(n, 1 / rate)[1:]
                fast = float(np.sum(model.psd(f[f <= cutoff_hz])) * rate / n)
                c = _bias_contrast(fold, pieces, data)
                total += n * (fast + float(c @ K @ c))
                count += n
    return float(np.sqrt(total / max(count, 1)))


def _pieces(runs: Sequence[RunData], length_s: float = 8.0) -> Blocks:
    time: list[float] = []
    duration: list[float] = []
    session: list[int] = []
    number: list[int] = []
    pose: list[int] = []
    for i, data in enumerate(runs):
        count = max(1, round(len(data.run) / data.run.rate_hz / length_s))
        edges = np.linspace(data.run.time[0], data.run.time[-1], count + 1)
        time.extend((edges[:-1] + edges[1:]) / 2)
        duration.extend(np.diff(edges))
        session.extend([data.run.session] * count)
        number.extend([i] * count)
        pose.extend([-1 if data.mounting_number is None else data.mounting_number] * count)
    rate = np.zeros((len(time), 3))
    of_session, of_run, of_pose = (np.array(x, dtype=np.int64) for x in (session, number, pose))
    return Blocks(np.array(time), np.array(duration), rate, of_session, of_run, of_pose)


def _bias_contrast(fold: Held, pieces: Blocks, data: RunData) -> FloatArray:
    """Weights of the pieces in (mean of a held-out run minus its session's bias), shape (b,)."""
    own = np.array([fold.everything[r] is data for r in pieces.run])
    fitted = np.array(
        [fold.everything[r].is_fit and fold.everything[r].run.session == data.run.session for r in pieces.run]
    )
    weights = np.where(own, pieces.duration, 0.0) / float(pieces.duration[own].sum())
    if fitted.any():
        weights = weights - np.where(fitted, pieces.duration, 0.0) / float(pieces.duration[fitted].sum())
    else:
        weights = weights - own / float(own.sum())
    return np.asarray(weights)


def pose_floor(folds: Sequence[Held], noise: Mapping[int, NoiseModel], drift: Mapping[int, Drift]) -> float:
    """What `pose_rms` would be if the model were complete."""
    total, count = 0.0, 0
    for fold in folds:
        for data in fold.held:
            for window in data.windows:
                if window.moving:
                    continue
                duration = len(window) / data.run.rate_hz
                for axis, model in noise.items():
                    span = float(np.ptp(data.run.time))
                    slow = drift[axis].flicker * np.log(max(span / duration, np.e)) + drift[axis].walk * span / 3
                    total += model.psd(np.array([0.5]))[0] / (2 * duration) + slow
                    count += 1
    return float(np.sqrt(total / max(count, 1)))


@dataclass(frozen=True)
class AttitudeTrace:
    """Angle between the true and the estimated vertical over one held-out run, rad."""

    run: str
    time: FloatArray
    gyro_only: Mapping[str, FloatArray]
    madgwick: Mapping[str, FloatArray]


def attitude_traces(folds: Sequence[Held]) -> list[AttitudeTrace]:
    """Vertical error of every held-out run, gyro alone and through Madgwick's filter, for the three models."""
    return [
        _trace(fold, data)
        for fold in folds
        for data in fold.held
        if np.isfinite(data.run.specific_force).all() and len(data.run.axes) == 3
    ]


def attitude_rms(traces: Sequence[AttitudeTrace], kind: str) -> Rms | None:
    """Pooled root mean squares of `gyro_only` or `madgwick`, rad."""
    if not traces:
        return None
    pooled = {m: np.concatenate([getattr(t, kind)[m] for t in traces]) for m in SHOWN}
    values = {m: float(np.sqrt(np.mean(v**2))) for m, v in pooled.items()}
    return Rms(values["raw"], values["declared"], values["full"])


def _trace(fold: Held, data: RunData) -> AttitudeTrace:
    run = data.run
    true = _true_vertical(fold, data)
    start = _mean_without_drive(data, run.specific_force)
    up0 = start / np.linalg.norm(start)
    gyro, madgwick = {}, {}
    for label in SHOWN:
        rate = run.angular_rate - fold.predictor.rate(data, fold.models[label], NOT_RIG)
        rate = rate - _mean_without_drive(data, rate)
        # first order: without a turn of more than a few degrees the vertical moves by -theta x up
        theta = np.concatenate([np.zeros((1, 3)), np.cumsum((rate[1:] + rate[:-1]) / 2, axis=0)]) / run.rate_hz
        gyro[label] = _angle(up0 - np.cross(theta, up0), true)
        filtered = Madgwick(MadgwickParameters())
        filtered.quaternion = attitude_at_rest(np.asarray(start, dtype=np.float64))
        force = np.asarray(run.specific_force, dtype=np.float64)
        q = filtered.batch(np.full(len(run), 1 / run.rate_hz), np.asarray(rate, dtype=np.float64), force)
        madgwick[label] = _angle(_up_of(q), true)
    return AttitudeTrace(run.name, run.time - run.time[0], gyro, madgwick)


def _true_vertical(fold: Held, data: RunData) -> FloatArray:
    """The session's mean direction at rest turned by the rig's own rotations, shape (n, 3)."""
    rest = [
        r.run.specific_force[w.start : w.stop].mean(axis=0)
        for r in fold.everything
        if r.run.session == data.run.session and r.mounting_number == data.mounting_number
        for w in r.windows
        if not w.moving
    ]
    mean = np.mean(rest, axis=0) if rest else data.geometry.mean_force
    up = mean / np.linalg.norm(mean)
    rig = fold.predictor.rate(data, fold.models["full"], frozenset({Owner.RIG}))
    turn = np.concatenate([np.zeros((1, 3)), np.cumsum((rig[1:] + rig[:-1]) / 2, axis=0)]) / data.run.rate_hz
    turn -= _mean_without_drive(data, turn)
    return np.asarray(up - np.cross(turn, up))


def _mean_without_drive(data: RunData, series: FloatArray) -> FloatArray:
    """Mean of (n, 3) with the drive's first harmonics fitted beside it, shape (3,)."""
    w = None if data.motion is None else data.motion.angular_frequency
    if w is None:
        return np.asarray(series.mean(axis=0))
    t = data.run.time - data.run.time.mean()
    window = next((x for x in data.windows if x.moving), Window(0, len(t), True))
    cut = slice(window.start, window.stop)
    phases = np.outer(t[cut], w * np.arange(1, 4))
    X = np.column_stack([np.ones(len(t[cut])), np.cos(phases), np.sin(phases)])
    return np.asarray(least_squares(X, series[cut])[0])


def _up_of(quaternion: FloatArray) -> FloatArray:
    """The earth's vertical in the sensor's axes from body -> ENU quaternions (w, x, y, z), shape (n, 3)."""
    w, x, y, z = quaternion.T
    return np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x**2 + y**2)], axis=1)


def _angle(a: FloatArray, b: FloatArray) -> FloatArray:
    cross = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.asarray(np.arctan2(cross, np.sum(a * b, axis=-1)))
