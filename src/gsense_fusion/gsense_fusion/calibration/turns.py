"""Scale and misalignment of the gyro from turns between still poses: gravity before and after says what the turn was.

The gyro shows (I + M) w. Integrated over a turn, w carries gravity's direction of one rest to that of the next; what
is missing is linear in M: delta = -int R (M w) dt (D. Tedaldi, A. Pretto, E. Menegatti, "A robust and easy to
implement method for IMU calibration without external equipments", ICRA 2014, solves the same by search). The bias of a
turn is the mean of its two rests', so drift does not matter. With G this is the 18-number calibration of Groves
(eq. 4.17).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.stats import f as fisher
from scipy.stats import norm, t

from gsense_fusion.compensation import AccelerometerCorrection, Matrix
from gsense_fusion.compiling import kernel
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.recording.stillness import still_stretches

FloatArray = NDArray[np.float64]
LONGEST_S = 40.0
SMALLEST_RAD = 0.2
MIN_TURNS = 10
MAX_STDERR = 0.01
FLOOR = 1e-4
"""Of the errors of M: integration between samples, and an accelerometer that is not perfect after its correction."""
ROUNDS = 3
SIGNIFICANCE = 0.01


@dataclass(frozen=True)
class Turn:
    """What happened between two rests, sensor axes."""

    rate: FloatArray
    """rad/s without bias and G f, one row an interval, shape (n, 3)."""
    dt: float
    before: FloatArray
    """Direction of gravity in the rest before (up), unit."""
    after: FloatArray


@dataclass(frozen=True)
class ScaleCalibration:
    """M of (I + M) w."""

    matrix: FloatArray
    """Shape (3, 3)."""
    stderr: FloatArray
    turns: int
    p_value: float
    """Of no M at all."""
    rms_before: float
    """Angle between gravity as carried over a turn and as found there, rad, turns not fitted."""
    rms_after: float

    @property
    def significant(self) -> bool:
        """Whether M is there and does turns good that it was not fitted to."""
        return self.p_value < SIGNIFICANCE and self.rms_after < self.rms_before

    @property
    def rows(self) -> Matrix:
        """As the compensation file holds it."""
        rows: Matrix = tuple(tuple(float(x) for x in row) for row in self.matrix)  # type: ignore[assignment]
        return rows


def find_turns(runs: Sequence[CleanRun], g: FloatArray, accelerometer: AccelerometerCorrection | None) -> list[Turn]:
    """Turns between consecutive rests of runs without a rig; without losses, short, and with gravity truly moved."""
    out = []
    for run in runs:
        if run.has_rig or len(run.axes) < 3 or not np.isfinite(run.specific_force).all():
            continue
        rate = np.asarray(run.angular_rate - run.specific_force @ g.T, dtype=np.float64)
        places = [
            (int(np.searchsorted(run.time, s.time[0])), int(np.searchsorted(run.time, s.time[-1]) + 1))
            for s in still_stretches(run)
        ]
        for (a0, a1), (b0, b1) in itertools.pairwise(places):
            turn = _turn(run, rate, accelerometer, (a0, a1, b0, b1))
            if turn is not None:
                out.append(turn)
    return out


def _turn(
    run: CleanRun, rate: FloatArray, accelerometer: AccelerometerCorrection | None, place: tuple[int, int, int, int]
) -> Turn | None:
    a0, a1, b0, b1 = place
    if (b0 - a1) / run.rate_hz > LONGEST_S or not run.valid[a1:b0].all():
        return None
    before, after = (_up(run.specific_force[i:j].mean(axis=0), accelerometer) for i, j in ((a0, a1), (b0, b1)))
    if float(before @ after) > np.cos(SMALLEST_RAD):
        return None
    bias = (rate[a0:a1].mean(axis=0) + rate[b0:b1].mean(axis=0)) / 2
    part = rate[a1 - 1 : b0 + 1] - bias
    return Turn(np.ascontiguousarray((part[1:] + part[:-1]) / 2), 1.0 / run.rate_hz, before, after)


def _up(force: FloatArray, accelerometer: AccelerometerCorrection | None) -> FloatArray:
    if accelerometer is not None:
        force = np.array(accelerometer.matrix) @ (force - np.array(accelerometer.bias))
    return np.asarray(force / np.linalg.norm(force))


def calibrate_scale(turns: Sequence[Turn]) -> ScaleCalibration | str:
    """Fit M to turns; words that say what is lacking where they do not determine it."""
    if len(turns) < MIN_TURNS:
        return f"{len(turns)} turns between still poses: {MIN_TURNS} are needed"
    start = _residuals(turns, np.zeros((3, 3)))[0]
    M = np.zeros((3, 3))
    for _ in range(ROUNDS):
        r, J = _residuals(turns, M)
        weight = _weights(r)
        step = _solve(r, J, weight)
        M = M + step.reshape(3, 3)
    r, J = _residuals(turns, M)
    w = np.repeat(weight, 3)
    spare = 2 * len(turns) - 9
    variance = float(np.sum(w * r.ravel() ** 2)) / spare
    normal = np.einsum("ij,i,ik->jk", J.reshape(-1, 9), w, J.reshape(-1, 9))
    if np.linalg.cond(normal) > 1e10:
        return "the turns do not fix all axes: turn about every axis"
    quantile = float(t.ppf(0.975, spare) / norm.ppf(0.975))
    stderr = np.sqrt(np.diag(variance * np.linalg.inv(normal)).reshape(3, 3) * quantile**2 + FLOOR**2)
    if stderr.max() > MAX_STDERR:
        return f"the turns leave scale open by {100 * stderr.max():.1f} %: more turns, about every axis"
    removed = float(np.sum(w * start.ravel() ** 2)) - variance * spare
    before, after = _left_out(turns, M)
    return ScaleCalibration(M, stderr, len(turns), float(fisher.sf(removed / 9 / variance, 9, spare)), before, after)


def _left_out(turns: Sequence[Turn], M: FloatArray) -> tuple[float, float]:
    """Angles without M, and with an M fitted to the other turns (one linear step from the common one)."""
    zero, _ = _residuals(turns, np.zeros((3, 3)))
    r, J = _residuals(turns, M)
    weight = _weights(r)
    left = []
    for i in range(len(turns)):
        keep = np.arange(len(turns)) != i
        left.append(r[i] - J[i] @ _solve(r[keep], J[keep], weight[keep]))
    rms = [float(np.sqrt(np.mean(np.sum(np.square(x), axis=-1)))) for x in (zero, np.array(left))]
    return rms[0], rms[1]


def _solve(r: FloatArray, J: FloatArray, weight: FloatArray) -> FloatArray:
    root = np.sqrt(np.repeat(weight, 3))
    step, *_ = np.linalg.lstsq(J.reshape(-1, 9) * root[:, None], r.ravel() * root, rcond=None)
    return np.asarray(step)


def _weights(r: FloatArray) -> FloatArray:
    """Huber's: a turn with a knock in it must not decide, shape (turns,)."""
    size = np.linalg.norm(r, axis=1)
    limit = 2.5 * max(float(np.median(size)), 1e-9)
    return np.asarray(np.minimum(1.0, limit / np.maximum(size, 1e-12)))


def _residuals(turns: Sequence[Turn], M: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gravity before each turn minus that carried back from after it, (turns, 3), and the derivative, (turns, 3, 9)."""
    inverse = np.linalg.inv(np.eye(3) + M)
    r, J = [], []
    for turn in turns:
        R, integral = _integrate(np.ascontiguousarray(turn.rate @ inverse.T), turn.dt)
        v = R @ turn.after
        cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
        r.append(turn.before - v)
        # before = v + delta x v = v - [v] delta, delta = -integral m
        J.append(cross @ integral)
    return np.array(r), np.array(J)


@kernel("Tuple((f8[:, ::1], f8[:, ::1]))(f8[:, ::1], f8)")
def _integrate(rate, dt):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Turn from the first to the last instant (end -> start axes), and int R[:, a] w_b dt, shape (3, 9)."""
    R = np.eye(3)
    out = np.zeros((3, 9))
    step = np.empty((3, 3))
    for k in range(rate.shape[0]):
        x, y, z = rate[k, 0] * dt, rate[k, 1] * dt, rate[k, 2] * dt
        angle = sqrt(x * x + y * y + z * z)
        a = sin(angle) / angle if angle > 1e-9 else 1.0
        b = (1.0 - cos(angle)) / (angle * angle) if angle > 1e-6 else 0.5
        step[0, 0], step[0, 1], step[0, 2] = 1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y
        step[1, 0], step[1, 1], step[1, 2] = b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x
        step[2, 0], step[2, 1], step[2, 2] = b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)
        after = R @ step
        for i in range(3):
            for j in range(3):
                mean = 0.5 * (R[i, j] + after[i, j])
                for m in range(3):
                    out[i, 3 * j + m] += mean * rate[k, m] * dt
        R = after
    return R, out
