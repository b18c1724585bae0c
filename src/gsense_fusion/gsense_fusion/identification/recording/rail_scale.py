"""The encoder's metres against gravity: the accelerometer carries the one to the other.

Still poses say what the accelerometer makes of gravity, motion what it makes of the acceleration that the encoder sees.
Scale, cross-axis sensitivity and bias of the accelerometer, gravity, the rail's slope and bow are unknown within what
data sheets and the earth allow, and integrated out; how much is left open then depends on the poses alone. By frequency
three things separate: a scale is the same at all, a belt's stretch grows with w^2, gravity along a bowed rail
falls with it. A low-pass only ever makes the accelerometer read less: it is no stretch.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from gsense_fusion.identification.campaign import Campaign, RunData
from gsense_fusion.identification.motion.mounting import Mounting
from gsense_fusion.identification.types import FloatArray

SCALES = slice(0, 3)
CROSS = slice(3, 6)
BIAS = slice(6, 9)
GRAVITY_PART, SLOPE, BOW, ERROR, STRETCH = range(9, 14)
PRIOR = np.array([*[0.03] * 3, *[0.01] * 3, *[0.5] * 3, 0.0015, 0.0175, 0.1, np.inf, 4e-4])
"""Standard deviations. MPU-6050 data sheet: scale 3 %, cross-axis 2 %, zero g 50 to 80 mg. Gravity on the earth 9.78 to
9.83 m/s^2; rails are level to a degree; bow in 1/s^2 (0.6 deg/m times gravity), stretch in s^2 (belt ringing at 8 Hz).
"""
MEAN_GRAVITY = 9.806
POSE_PART = 1e-3
"""Of gravity, that a pose's mean is known to: the bias wanders with temperature by a mg."""
LEVEL_RAD = 2e-3
RUN_PART = 5e-4
"""Of a run's acceleration, beside its noise."""
PRIOR_RUNS = 2.0
"""Weight of the runs' own errors beside their scatter."""
ROUNDS = 3


@dataclass(frozen=True, eq=False)
class RailScale:
    """What the encoder reads for a true metre, with standard errors."""

    error: float
    """Encoder over truth, less one, at standstill."""
    error_stderr: float
    stretch: float
    """The carriage moves by 1 + stretch w^2 of what the encoder sees, s^2; negative where a filter outweighs it."""
    stretch_stderr: float
    frequencies: FloatArray
    """Of the runs' drives, rad/s, increasing, shape (n,)."""
    ratio: FloatArray
    """Acceleration felt over the encoder's, the accelerometer's and the bow's share taken out, shape (n,)."""

    def expected(self, frequencies: FloatArray) -> FloatArray:
        """The ratio by the two parameters, shape (n,)."""
        return np.asarray(np.exp(self.stretch * frequencies**2) / (1.0 + self.error))


@dataclass(frozen=True, eq=False)
class _Runs:
    """Moving runs: d(specific force)/d(encoder's acceleration), its relative error, the drive's frequency."""

    slope: FloatArray
    part: FloatArray
    frequency: FloatArray


def rail_scale(campaign: Campaign) -> RailScale | None:
    """The encoder's scale; None where no accelerometer felt a steady motion."""
    runs = _moving(campaign.runs)
    if runs is None:
        return None
    poses = [m for m in campaign.mountings if np.isfinite(m.up).all() and np.isfinite(m.gravity)]
    own, spread = np.hypot(runs.part, RUN_PART), 1.0
    x, covariance = np.zeros(len(PRIOR)), np.eye(len(PRIOR))
    for _ in range(ROUNDS):  # friction's kicks are no noise: how well the runs are known they say themselves
        found = least_squares(_deviations, np.zeros(len(PRIOR)), args=(runs, own * spread, poses), x_scale="jac")
        slope = np.asarray(found.jac)
        x, covariance = np.asarray(found.x), np.linalg.inv(slope.T @ slope)
        free = max(0, len(runs.frequency) - 3)
        square = float(np.sum((_unexplained(x, runs) / own) ** 2))
        spread = float(np.sqrt((square + PRIOR_RUNS) / (free + PRIOR_RUNS)))
    order = np.argsort(runs.frequency)
    w = runs.frequency[order]
    left = np.exp(_unexplained(x, runs)[order] + x[STRETCH] * w**2) / (1.0 + x[ERROR])
    error, stretch = (float(np.sqrt(covariance[i, i])) for i in (ERROR, STRETCH))
    return RailScale(float(x[ERROR]), error, float(x[STRETCH]), stretch, w, left)


def _moving(runs: Sequence[RunData]) -> _Runs | None:
    slope, part, frequency = [], [], []
    for run in runs:
        g, w = run.geometry, None if run.motion is None else run.motion.angular_frequency
        if g.along is None or g.delay is None or w is None or not np.isfinite(g.along).all():
            continue
        slope.append(g.along)
        part.append(g.delay.stderr * w)  # an error in phase is as large as one in amplitude
        frequency.append(w)
    return _Runs(np.array(slope), np.array(part), np.array(frequency)) if slope else None


def _inverse(x: FloatArray) -> FloatArray:
    """What makes of the accelerometer's readings true ones: symmetric, its turn against the board is no error."""
    a, b, c = x[CROSS]
    return np.asarray(np.eye(3) - np.diag(x[SCALES]) - np.array([[0, a, b], [a, 0, c], [b, c, 0]]))


def _unexplained(x: FloatArray, runs: _Runs) -> FloatArray:
    """Logarithm of what was felt over what should have been, shape (n,)."""
    felt = np.log(np.linalg.norm(runs.slope @ _inverse(x).T, axis=1))
    return np.asarray(felt + np.log1p(x[ERROR]) - x[STRETCH] * runs.frequency**2 - x[BOW] / runs.frequency**2)


def _deviations(x: FloatArray, runs: _Runs, sigma: FloatArray, poses: Sequence[Mounting]) -> FloatArray:
    """Everything in its own standard deviations: runs, gravity's length, the level rail, what is known before."""
    inverse = _inverse(x)
    out = [_unexplained(x, runs) / sigma, (x / PRIOR)[np.isfinite(PRIOR)]]
    for pose in poses:
        true = inverse @ (pose.gravity * pose.up - x[BIAS])
        out.append(np.array([np.log(np.linalg.norm(true) / (MEAN_GRAVITY * (1.0 + x[GRAVITY_PART]))) / POSE_PART]))
        if pose.along is not None:
            rail = inverse @ pose.along
            sine = float(rail @ true) / float(np.linalg.norm(rail) * np.linalg.norm(true))
            out.append(np.array([(sine - x[SLOPE]) / LEVEL_RAD]))
    return np.concatenate(out)
