"""The IMU's clock against the encoder's: the accelerometer feels what the encoder sees, later and later."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm, t

from gsense_fusion.identification.campaign import Campaign, RunData, build_campaign
from gsense_fusion.identification.motion.harmonics import Harmonics, least_squares
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.recording.rough_clock import rough_skew
from gsense_fusion.identification.types import FloatArray

ROUNDS = 4
SURE = 5.0
SHAPE = 1e-5
"""What the carriage's settling after the ramp makes of the skew within runs of 15 s (in simulation up to 1.7e-5)."""
CORRECTED_FROM = 1e-5
"""A smaller skew moves the ends of a run by less than the delay is known: nothing is corrected."""
ROUGH = 5e-4
"""Standard error of a skew that only the motion's ends tell."""
FEWEST_FREE = 3
"""Runs beyond those that offset and slope take, from which a growing delay is told from a scattering one."""
PIECES = 6
MIN_FORCE_S = 3.0
FEWEST_BINS = 8
BINS_ABOVE = 32
"""Above the orders, where a short motion leaves none between them; higher up the sensor's filter takes the noise."""


@dataclass(frozen=True)
class Skew:
    """How much faster than the encoder's clock the IMU's runs (1e-6 is one ppm)."""

    value: float
    stderr: float
    free: bool
    """Whether both clocks ran on from run to run."""

    @property
    def sure(self) -> bool:
        """Whether it differs from zero."""
        return abs(self.value) > SURE * self.stderr


def on_one_clock(runs: Sequence[CleanRun]) -> tuple[Campaign, Skew | None]:
    """The campaign with the IMU's times as the encoder's clock tells them, and the skew (None where nothing tells it).

    A skew that is not sure, or too small to matter, is reported and left: a correction that is noise would only spoil
    the delays.
    """
    rough = rough_skew(runs)
    if rough is None:
        return _on_near_clocks(runs)
    campaign, rest = _on_near_clocks([corrected(r, Skew(rough, 0.0, True)) for r in runs])
    return campaign, Skew(rough, ROUGH, True) if rest is None else _both(Skew(rough, 0.0, True), rest)


def _both(first: Skew, then: Skew) -> Skew:
    """Two corrections one after the other."""
    return Skew((1.0 + first.value) * (1.0 + then.value) - 1.0, then.stderr, True)


def _on_near_clocks(runs: Sequence[CleanRun]) -> tuple[Campaign, Skew | None]:
    """The same where the clocks are within a fraction of the drive's period of each other."""
    campaign = build_campaign(runs)
    within, across = within_runs(campaign.runs), across_runs(campaign.runs)
    if within is None:
        return campaign, None
    if across is not None and abs(across.value - within.value) < SURE * within.stderr:
        return (build_campaign([corrected(r, across) for r in runs]) if _matters(across) else campaign), across
    if not _matters(within):
        return campaign, within
    # were the clocks set anew for every run, or did they run on? Then the delays agree after the correction
    free = replace(within, free=True)
    anew, on = (build_campaign([corrected(r, s) for r in runs]) for s in (within, free))
    if _scatter(anew) <= _scatter(on):
        return anew, within
    rest = across_runs(on.runs)
    if rest is None:
        return on, free
    exact = _both(free, rest)
    return build_campaign([corrected(r, exact) for r in runs]), exact


def _matters(skew: Skew) -> bool:
    return skew.sure and abs(skew.value) > CORRECTED_FROM


def _scatter(campaign: Campaign) -> float:
    """Of the delays from run to run in standard errors; infinite where a run that moves has none."""
    known = [r.geometry.delay for r in campaign.runs if r.motion is not None and r.motion.steady is not None]
    if any(d is None for d in known):
        return float("inf")
    z = [(d.value - campaign.delay.value) / d.stderr for d in known if d is not None]
    return float(np.sum(np.square(z)))


def within_runs(runs: Sequence[RunData]) -> Skew | None:
    """Weighted mean over the runs in steady motion; None where no accelerometer feels one.

    The error is the larger of what the accelerometer's noise and what the scatter of the runs makes.
    """
    found = [s for s in (_of_run(r) for r in runs) if s is not None]
    return _mean(found) if found else None


def _mean(found: Sequence[tuple[float, float]]) -> Skew:
    """Weighted mean of the runs' own skews."""
    value, error = (np.array(x) for x in zip(*found, strict=True))
    weight = 1.0 / error**2
    mean = float(np.sum(weight * value) / weight.sum())
    stderr = float(1.0 / np.sqrt(weight.sum()))
    if len(found) > 1:
        chi2 = float(np.sum(weight * (value - mean) ** 2)) / (len(found) - 1)
        stderr *= float(np.sqrt(max(1.0, chi2)))
    return Skew(mean, float(np.hypot(stderr, SHAPE)), False)


def _of_run(data: RunData) -> tuple[float, float] | None:
    """Skew of one run with its standard error, by regression of the specific force on [1, a, j, (t - tm) j]."""
    steady = _steady(data)
    if steady is None:
        return None
    time, force, drive = steady
    lowest = drive.lowest(3)
    middle, skew, delay, error = float(time.mean()), 0.0, data.delay_s, np.inf
    for _ in range(ROUNDS):
        kin = lowest.at(middle + (time - middle) / (1.0 + skew) - delay)
        X = np.column_stack([np.ones(len(time)), kin.acceleration, kin.jerk, (time - middle) * kin.jerk])
        beta = least_squares(X, force)
        size = float(beta[1] @ beta[1])
        if size < 0.25:
            return None
        delay -= float(beta[2] @ beta[1]) / size
        skew -= float(beta[3] @ beta[1]) / size
        rest = (force - X @ beta) @ beta[1] / np.sqrt(size)
        noise = _level_beside_orders(rest, data.run.rate_hz, lowest.angular_frequency)
        error = noise / np.sqrt(size * float(np.sum(X[:, 3] ** 2)))
    return (skew, error) if np.isfinite(error) and error > 0 else None


def _level_beside_orders(rest: FloatArray, rate_hz: float, w: float) -> float:
    """Deviation of a sample that white noise of the residual's level between the drive's lowest orders would have."""
    taper = np.hanning(len(rest))
    power = np.abs(np.fft.rfft((rest - rest.mean()) * taper)) ** 2 / float(taper @ taper)
    order = np.arange(len(power)) * rate_hz / len(rest) * 2 * np.pi / w
    width = 3.0 * rate_hz / len(rest) * 2 * np.pi / w
    beside = (order > 0.3) & (order < 4.7) & (np.abs(order - np.rint(order)) > width)
    above = power[order >= 4.7][:BINS_ABOVE]
    return float(np.sqrt(np.mean(power[beside] if beside.sum() >= FEWEST_BINS else above)))


def _steady(data: RunData) -> tuple[FloatArray, FloatArray, Harmonics] | None:
    run, motion = data.run, data.motion
    if motion is None or motion.steady is None or motion.harmonics is None:
        return None
    if not np.isfinite(run.specific_force).all() or data.geometry.delay is None:
        return None
    inside = run.valid & (run.time >= motion.steady.start + 0.2) & (run.time <= motion.steady.stop - 0.2)
    if inside.sum() < MIN_FORCE_S * run.rate_hz:
        return None
    return run.time[inside], run.specific_force[inside], motion.harmonics


def across_runs(runs: Sequence[RunData]) -> Skew | None:
    """Skew of clocks that ran on from run to run: the delay grows over the session; None where it does not."""
    known = [(r, r.geometry.delay) for r in runs if r.geometry.delay is not None]
    time = np.array([float(r.run.time.mean()) for r, _ in known])
    late, error = np.array([[d.value, d.stderr] for _, d in known]).reshape(-1, 2).T
    own = np.array([[r.run.session == s for s in sorted({r.run.session for r in runs})] for r, _ in known], dtype=float)
    free = len(known) - 1 - (int(own.any(axis=0).sum()) if known else 0)
    if free < FEWEST_FREE:
        return None
    X = np.column_stack([time - time.mean(), own[:, own.any(axis=0)]]) / error[:, None]
    beta, *_ = np.linalg.lstsq(X, late / error, rcond=None)
    scatter = float(np.sqrt(np.sum((late / error - X @ beta) ** 2) / free))
    # few runs tell their scatter badly: Student's t, and never better than half of what their errors say
    stderr = max(scatter, 0.5) * float(np.sqrt(np.linalg.pinv(X.T @ X)[0, 0]) * t.isf(norm.sf(1.0), free))
    return Skew(float(beta[0]), stderr, True) if abs(beta[0]) > SURE * stderr else None


def corrected(run: CleanRun, skew: Skew) -> CleanRun:
    """The run with its samples' times as the encoder's clock would have told them."""
    origin = 0.0 if skew.free else float(run.time.mean())
    time = origin + (run.time - origin) / (1.0 + skew.value)
    magnetic = run.magnetic
    if magnetic is not None:
        magnetic = replace(magnetic, time=origin + (magnetic.time - origin) / (1.0 + skew.value))
    return replace(run, time=time, rate_hz=run.rate_hz * (1.0 + skew.value), magnetic=magnetic)


def delay_over_time(campaign: Campaign) -> tuple[FloatArray, FloatArray]:
    """Delay of pieces of the runs against their run's middle: times in s and delays in s, each shape (p,), sorted."""
    when: list[float] = []
    late: list[float] = []
    for data in campaign.runs:
        steady = _steady(data)
        if steady is None:
            continue
        time, force, drive = steady
        lowest, found = drive.lowest(3), []
        for piece in np.array_split(np.arange(len(time)), PIECES):
            kin = lowest.at(time[piece] - data.delay_s)
            X = np.column_stack([np.ones(len(piece)), kin.acceleration, kin.jerk])
            beta, *_ = np.linalg.lstsq(X, force[piece], rcond=None)
            found.append(-float(beta[2] @ beta[1]) / float(beta[1] @ beta[1]))
        late.extend(np.array(found) - np.mean(found))
        when.extend(float(time[p].mean() - time.mean()) for p in np.array_split(np.arange(len(time)), PIECES))
    order = np.argsort(when)
    return np.array(when)[order], np.array(late)[order]
