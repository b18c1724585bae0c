"""Still stretches of a bag without a rig: there, and only there, the true rate is known to be zero."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import FloatArray, IdentificationError

WINDOW_S = 0.5
MIN_STRETCH_S = 1.0
TRIM_S = 0.2
GYRO_FACTOR = 2.0
FORCE_FACTOR = 3.0
"""A window is still where its deviations are within these factors of the record's quietest windows."""
QUIET_QUANTILE = 0.05
MAX_DRIFT_RAD = 0.01
"""A stretch whose gravity direction moves by more is a slow turn, not rest."""
MAX_TURN_RAD_S = 2e-4
TURN_SIGMA = 5.0
"""Nor is one whose gravity turns evenly by more than this rate (0.011 deg/s), seen at so many standard errors."""
DISTINCT_RAD = 0.17
MIN_POSES = 6
MIN_GYRO_QUIET = 1e-6
MAX_GYRO_QUIET = 0.02
"""rad/s: quietest windows above this (1.1 deg/s) are not rest at all."""


def still_stretches(run: CleanRun) -> list[CleanRun]:
    """Cut a run without a rig into its still stretches, each a run of its own.

    Raises:
        IdentificationError: No accelerometer, or no window of the record is still.

    """
    if not np.isfinite(run.specific_force).all():
        raise IdentificationError(f"{run.path}: no rig topics and no accelerometer: rest cannot be told from motion")
    width = max(5, round(WINDOW_S * run.rate_hz))
    gyro = _moving_std(run.angular_rate[:, list(run.axes)], width)
    force = _moving_std(run.specific_force, width)
    quiet_gyro = np.maximum(np.quantile(gyro, QUIET_QUANTILE, axis=0), MIN_GYRO_QUIET)
    quiet_force = np.maximum(np.quantile(force, QUIET_QUANTILE, axis=0), 1e-4)
    if quiet_gyro.max() > MAX_GYRO_QUIET:
        raise IdentificationError(
            f"{run.path}: nothing is still enough (quietest gyro deviation {np.degrees(quiet_gyro.max()):.1f} deg/s); "
            "put the sensor down in each pose"
        )
    still = (gyro < GYRO_FACTOR * quiet_gyro).all(axis=1) & (force < FORCE_FACTOR * quiet_force).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(np.int8), [0]])))
    trim = round(TRIM_S * run.rate_hz)
    out: list[CleanRun] = []
    for start, stop in zip(edges[::2] + trim, edges[1::2] - trim, strict=True):
        if (stop - start) / run.rate_hz >= MIN_STRETCH_S and _steady(run.specific_force[start:stop], run.rate_hz):
            out.append(_cut(run, int(start), int(stop), len(out)))
    return out


def _moving_std(series: FloatArray, width: int) -> FloatArray:
    centred = series - series.mean(axis=0)
    mean = uniform_filter1d(centred, width, axis=0)
    return np.asarray(np.sqrt(np.maximum(uniform_filter1d(centred**2, width, axis=0) - mean**2, 0.0)))


def _steady(force: FloatArray, rate_hz: float) -> bool:
    """Gravity points the same way in the first and the last third, and does not creep."""
    third = max(1, len(force) // 3)
    a, b = force[:third].mean(axis=0), force[-third:].mean(axis=0)
    if np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b) >= MAX_DRIFT_RAD:
        return False
    mean = force.mean(axis=0)
    strength = float(np.linalg.norm(mean))
    t = (np.arange(len(force)) - (len(force) - 1) / 2) / rate_hz
    slope = t @ force / float(t @ t)
    rest = force - mean - np.outer(t, slope)
    stderr = float(np.sqrt(np.mean(rest**2) / float(t @ t))) / strength
    turn = float(np.linalg.norm(slope - mean * float(slope @ mean) / strength**2)) / strength
    return not (turn > MAX_TURN_RAD_S and turn > TURN_SIGMA * stderr)


def _cut(run: CleanRun, start: int, stop: int, number: int) -> CleanRun:
    cut = slice(start, stop)
    return replace(
        run,
        name=f"{run.name} pose {number + 1}",
        time=run.time[cut],
        angular_rate=run.angular_rate[cut],
        specific_force=run.specific_force[cut],
        valid=run.valid[cut],
        lost=int(np.sum(~run.valid[cut])),
        received=int(np.sum(run.valid[cut])),
        temperature=None if run.temperature is None else run.temperature[cut],
    )


def distinct_poses(stretches: Sequence[CleanRun]) -> int:
    """Number of directions of gravity that differ by more than ten degrees."""
    found: list[FloatArray] = []
    for stretch in stretches:
        mean = stretch.specific_force.mean(axis=0)
        up = mean / np.linalg.norm(mean)
        if all(float(up @ other) < np.cos(DISTINCT_RAD) for other in found):
            found.append(up)
    return len(found)


def expand_still(runs: Sequence[CleanRun]) -> list[CleanRun]:
    """Replace runs without a rig by their still stretches.

    Raises:
        IdentificationError: No run has a rig and there are fewer than six distinct still poses.

    """
    out: list[CleanRun] = []
    for run in runs:
        out.extend([run] if run.has_rig else still_stretches(run))
    if not any(r.has_rig for r in runs):
        poses = distinct_poses(out)
        if poses < MIN_POSES:
            names = ", ".join(sorted({r.path for r in runs}))
            raise IdentificationError(
                f"{names}: no rig topics, and only {poses} distinct still poses (at least {MIN_POSES} are needed, "
                f"each still for {MIN_STRETCH_S + 2 * TRIM_S:g} s); put the sensor down in more poses"
            )
    return out
