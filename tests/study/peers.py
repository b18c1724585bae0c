"""What other methods make of a session: the same sensor's data, the same runs to fit, the same runs to be judged by.

Fixed models: the thesis's scalar k (its equation 7.4), a 3 x 3 matrix G, and G with polynomials of the acceleration,
which the thesis proposes. Selection from a library of columns: ordinary least squares with nested F-tests, and
sequentially thresholded least squares (STLSQ; Brunton, Proctor, Kutz, PNAS 113, 2016; the same as PySINDy's, which
`stlsq.py` checks) with its threshold chosen by leaving runs out. Their library has a column for every smooth effect of
motion, temperature and supply, so what they miss of those is the method's doing; alike columns count as the same.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, savgol_filter, sosfiltfilt
from scipy.stats import f as f_distribution

from gsense_fusion.bags.run import Run

from .reference import held_out_rms
from .simulator import Session

Array = NDArray[np.float64]
LIBRARY: Mapping[str, int] = {
    "g_sensitivity": 3,
    "g_squared": 1,
    "g_cubed": 1,
    "jerk_coupling": 1,
    "rail_curvature": 2,
    "friction_pickup": 1,
    "temperature_bias": 1,
    "supply_voltage": 1,
}
"""Columns of each group, in this order; the same ones for every gyro axis."""
ALIKE = {"time_offset": "jerk_coupling", "belt_tilt": "jerk_coupling", "speed_pickup": "rail_curvature"}
"""To first order the same column in one mounting: naming the one for the other is taken for exact."""
ALPHA = 0.01
THRESHOLDS = tuple(np.radians(x) for x in (0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.032))
"""Least root mean square of a kept column's part in the rate, rad/s."""
SMOOTH_HZ = 15.0


@dataclass(frozen=True)
class Peer:
    """What one method found and left."""

    found: list[str]
    """Groups beyond g_sensitivity; empty for fixed models."""
    floor_ratio: float
    """Held-out rate below 5 Hz over the realised noise."""
    selects: bool = True


@dataclass(frozen=True, eq=False)
class _Data:
    columns: list[Array]
    """By run, shape (n, m), a constant last."""
    rate: list[Array]
    fit: list[int]
    group: Array
    """Number of each column's group, -1 for the constant."""


def peers(session: Session, noise: float) -> dict[str, Peer]:
    """Every peer on a session; `noise` is the held-out root mean square of the realised noise."""
    data = _prepare(session)
    g, a = data.group == 0, np.isin(data.group, (0, 1, 2))
    free = data.group < 0
    found = {"OLS, nested F-tests": _nested(data), "STLSQ": _stlsq(data)}
    out = {
        "thesis's k": Peer([], _judged(session, data, _scalar(data)) / noise, selects=False),
        "G": Peer([], _judged(session, data, _solved(data, g | free)) / noise, selects=False),
        "G, a^2, a^3": Peer([], _judged(session, data, _solved(data, a | free)) / noise, selects=False),
    }
    for name, keep in found.items():
        groups = sorted({list(LIBRARY)[int(i)] for i in data.group[keep.any(axis=1)] if i > 0})
        out[name] = Peer(groups, _judged(session, data, _solved(data, keep)) / noise)
    return out


def same(found: Sequence[str], truth: frozenset[str]) -> bool:
    """Whether a peer's groups are the true set, alike columns being one."""
    return set(found) == {ALIKE.get(n, n) for n in truth}


def _prepare(session: Session) -> _Data:
    runs = [run for run, _ in session.runs]
    along = _direction(runs)
    raw = [_columns(run, along) for run in runs]
    centre = np.mean([c.mean(axis=0) for c in raw], axis=0)
    columns = [np.column_stack([c - centre, np.ones(len(c))]) for c in raw]
    group = np.concatenate([np.full(k, i) for i, k in enumerate(LIBRARY.values())] + [[-1]])
    fit = [i for i, (_, role) in enumerate(session.runs) if role == "fit"]
    return _Data(columns, [run.imu.angular_rate for run in runs], fit, group)


def _direction(runs: Sequence[Run]) -> Array:
    """Along which the board is accelerated, sensor axes."""
    total = sum(np.cov(run.imu.specific_force.T) for run in runs)
    return np.asarray(np.linalg.eigh(total)[1][:, -1])


def _columns(run: Run, along: Array) -> Array:
    """The library on one run: force and its powers from the accelerometer, position and velocity from the encoder."""
    time = (run.imu.stamp_ns - run.imu.stamp_ns[0]) * 1e-9
    rate = 1.0 / float(np.median(np.diff(time)))
    low = butter(2, min(SMOOTH_HZ, 0.4 * rate), fs=rate, output="sos")
    force = sosfiltfilt(low, run.imu.specific_force, axis=0)
    a = (force - force.mean(axis=0)) @ along
    assert run.pose is not None
    at = (run.pose.stamp_ns - run.imu.stamp_ns[0]) * 1e-9
    even = np.arange(at[0], at[-1], 1 / 200.0)
    s = np.interp(even, at, run.pose.position)
    v = savgol_filter(s, 41, 4, deriv=1, delta=1 / 200.0)
    # the filter's delay, which the accelerometer shares with the gyro: where accelerations agree best
    encoder = np.interp(time, even, savgol_filter(s, 41, 4, deriv=2, delta=1 / 200.0))
    lags = np.arange(-8, 9)
    late = int(lags[np.argmax([abs(float(np.roll(encoder, k) @ a)) for k in lags])]) / rate
    s, v = np.interp(time - late, even, s), np.interp(time - late, even, v)
    slow = [_interpolated(x, run.imu.stamp_ns) for x in (run.temperature, run.battery)]
    return np.column_stack([force, a**2, a**3, np.gradient(a, time), v, v * s, np.tanh(v / 2e-3), *slow])


def _interpolated(series: object, stamps: NDArray[np.int64]) -> Array:
    if series is None:
        return np.zeros(len(stamps))
    at = (series.stamp_ns - stamps[0]) * 1e-9  # type: ignore[attr-defined]
    line = np.polyfit(at, series.value, 2)  # type: ignore[attr-defined]
    return np.asarray(np.polyval(line, (stamps - stamps[0]) * 1e-9))


def _grams(data: _Data, runs: Sequence[int]) -> tuple[Array, Array, Array, int]:
    """X'X (m, m), X'y (m, 3), y'y (3,) and the number of samples."""
    X, y = (np.concatenate([part[i] for i in runs]) for part in (data.columns, data.rate))
    return X.T @ X, X.T @ y, np.sum(y**2, axis=0), len(X)


def _least_squares(xx: Array, xy: Array, keep: NDArray[np.bool_]) -> Array:
    """Coefficients (m,), zero where a column is not kept; columns in their own sizes, ridge of 1e-9."""
    beta, i = np.zeros(len(xy)), np.flatnonzero(keep)
    size = np.sqrt(np.diag(xx)[i]) + 1e-30
    inner = xx[np.ix_(i, i)] / np.outer(size, size) + 1e-9 * np.eye(len(i))
    beta[i] = np.linalg.solve(inner, xy[i] / size) / size
    return beta


def _solved(data: _Data, keep: NDArray[np.bool_]) -> Array:
    """Coefficients (m, 3) of the kept columns: (m,) for all axes, or (m, 3)."""
    xx, xy, _, _ = _grams(data, data.fit)
    keep = np.repeat(keep[:, None], 3, axis=1) if keep.ndim == 1 else keep
    return np.stack([_least_squares(xx, xy[:, i], keep[:, i]) for i in range(3)], axis=1)


def _scalar(data: _Data) -> Array:
    """k [a_y, a_z, a_x] and a bias on each axis: one unknown for all axes."""
    xx, xy, _, n = _grams(data, data.fit)
    centred = xx[:3, :3] - np.outer(xx[:3, -1], xx[-1, :3]) / n
    own = [(i, (i + 1) % 3) for i in range(3)]
    cross = xy[:3] - np.outer(xx[:3, -1], xy[-1]) / n
    k = sum(cross[j, i] for i, j in own) / sum(centred[j, j] for _, j in own)
    beta = np.zeros(xy.shape)
    for i, j in own:
        beta[j, i] = k
        beta[-1, i] = (xy[-1, i] - k * xx[-1, j]) / n
    return beta


def _nested(data: _Data) -> NDArray[np.bool_]:
    """Forward steps, each the group with the smallest p of an F-test on all axes together, while under 1 %."""
    xx, xy, yy, n = _grams(data, data.fit)
    kept = np.isin(data.group, (-1, 0))

    def left(keep: NDArray[np.bool_]) -> float:
        return float(sum(yy[i] - _least_squares(xx, xy[:, i], keep) @ xy[:, i] for i in range(3)))

    while True:
        base = left(kept)
        tried = []
        for g in set(data.group[~kept].tolist()):
            larger = kept | (data.group == g)
            extra = 3 * int((data.group == g).sum())
            rest = 3 * (n - int(larger.sum()))
            gain = (base - left(larger)) / extra / (left(larger) / rest)
            tried.append((float(f_distribution.logsf(max(gain, 0.0), extra, rest)), g))
        if not tried or min(tried)[0] > np.log(ALPHA):
            return np.repeat(kept[:, None], 3, axis=1)
        kept = kept | (data.group == min(tried)[1])


def _stlsq(data: _Data) -> NDArray[np.bool_]:
    """Kept columns (m, 3); the threshold is the one whose model predicts runs left out best."""
    parts = {i: _grams(data, [i]) for i in data.fit}
    whole = _grams(data, data.fit)
    scores = []
    for threshold in THRESHOLDS:
        error = 0.0
        for xx, xy, yy, n in parts.values():
            rest = (whole[0] - xx, whole[1] - xy, whole[3] - n)
            for axis in range(3):
                beta = _least_squares(rest[0], rest[1][:, axis], _thresholded(data, *rest, axis, threshold))
                error += float(yy[axis] - 2 * beta @ xy[:, axis] + beta @ xx @ beta)
        scores.append(error)
    best = THRESHOLDS[int(np.argmin(scores))]
    return np.stack([_thresholded(data, whole[0], whole[1], whole[3], axis, best) for axis in range(3)], axis=1)


def _thresholded(data: _Data, xx: Array, xy: Array, n: int, axis: int, threshold: float) -> NDArray[np.bool_]:
    size = np.sqrt(np.diag(xx) / n)
    declared = np.isin(data.group, (-1, 0))
    keep = np.ones(len(xx), dtype=bool)
    for _ in range(20):
        beta = _least_squares(xx, xy[:, axis], keep)
        smaller = keep & (declared | (np.abs(beta) * size >= threshold))
        if (smaller == keep).all():
            break
        keep = smaller
    return keep


def _judged(session: Session, data: _Data, beta: Array) -> float:
    """Held-out error of coefficients (m, 3)."""
    return held_out_rms(session, [y - X @ beta for X, y in zip(data.columns, data.rate, strict=True)])
