"""The carriage's acceleration taken out of the specific force, from the encoder's positions alone.

Around a sample, acceleration and jerk are those of the cubic that fits the positions of `window_s` best. How the board
is mounted on the carriage is not asked for: each axis of the specific force is regressed on acceleration and jerk while
the run goes on (the jerk takes up a small delay between encoder and sensor), and that share is taken off. Nothing else
of the specific force is touched, so gravity stays, and with it every tilt that does not follow the acceleration.

The cubic needs positions after the sample as well, so the cleaned specific force is `delay_s` old. A filter whose
accelerometer step is slow does not mind.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from gsense_fusion.compiling import kernel

from .compiled import require_positive
from .interface import FloatArray, IntArray


@dataclass(frozen=True)
class CarriageParameters:
    """How the acceleration is found and taken off."""

    window_s: float = 0.12
    """s. Small: noise of the encoder (50 um steps: 5 mm/s^2 at 0.12 s); large: bends fast motion (8 rad/s: 1.6 %)."""
    delay_s: float = 0.08
    """s, age of the cleaned specific force; positions may come late by this less half the window."""
    force_deviation: float = 0.05
    """m/s^2, noise of the accelerometer per sample."""
    doubt: float = 0.2
    """m/s^2: while the share to take off is known no better than this, there is no cleaned specific force."""

    def __post_init__(self) -> None:
        require_positive(
            "rig_aided",
            window_s=self.window_s,
            delay_s=self.delay_s - 0.5 * self.window_s,
            force_deviation=self.force_deviation,
            doubt=self.doubt,
        )


_PRIOR = (100.0, 1.0, 4e-4)
"""Variances of gravity's share (m/s^2)^2, of the mounting's cosine, and of the delay (s^2) before any sample."""
_WALK = (1e-3, 1e-6, 1e-10)
"""Growth of these per s: a board may be turned by hand, a mounting may give."""
_BEYOND_RAILS = 1e6
"""m/s^2, m/s^3: what no carriage does and no sensor reports; taken in, it would stay in the regression for good."""
_LEAST_POSITIONS = 8
_MOST_POSITIONS = 1 << 24
_SLACK_S = 0.1
_NEW_BEGINNING_NS = 1_000_000_000


@kernel("f8[::1](f8[::1], f8[::1], f8, f8)")
def _motion(t, position, at, half):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Acceleration and jerk at `at` of the best cubic within `half` around it; NaN with too few positions."""
    lo, hi = np.searchsorted(t, at - half), np.searchsorted(t, at + half, side="right")
    out = np.full(2, np.nan)
    if hi - lo < _LEAST_POSITIONS or t[lo] > at - 0.7 * half or t[hi - 1] < at + 0.7 * half:
        return out
    normal, right = np.zeros((4, 4)), np.zeros(4)
    base = position[lo]
    for k in range(lo, hi):
        u = (t[k] - at) / half
        powers = (1.0, u, u * u, u * u * u)
        for i in range(4):
            right[i] += powers[i] * (position[k] - base)
            for j in range(4):
                normal[i, j] += powers[i] * powers[j]
    if not np.isfinite(right).all():  # positions so far from one another that their sums overflow
        return out
    solution = np.linalg.solve(normal, right)
    out[0] = 2.0 * solution[2] / half**2
    out[1] = 6.0 * solution[3] / half**3
    return out


@kernel("f8[::1](f8[:, ::1], f8[:, ::1], f8, f8[::1], f8[::1], f8, f8)")
def _clean(p, c, dt, force, motion, variance, doubt):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """A step of the regression (covariance p, coefficients c: 3 axes x [1, acceleration, jerk]); the cleaned force."""
    out = np.full(3, np.nan)
    if not ((np.abs(motion) < _BEYOND_RAILS).all() and (np.abs(force) < _BEYOND_RAILS).all()):  # NaN compares false
        return out
    for i in range(3):
        p[i, i] = min(p[i, i] + _WALK[i] * dt, _PRIOR[i])
    x = np.array([1.0, motion[0], motion[1]])
    px = p @ x
    gain = px / (x @ px + variance)
    for axis in range(3):
        c[axis] += gain * (force[axis] - c[axis] @ x)
    p -= np.outer(gain, px)
    x[0] = 0.0
    if x @ (p @ x) <= doubt * doubt:
        for axis in range(3):
            out[axis] = force[axis] - c[axis] @ x
    return out


@kernel(
    "Tuple((f8[:, ::1], i8))(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], i8, f8[::1], f8[::1], f8[::1], f8, f8[::1])"
)
def _clean_all(p, c, t, force, first, pt, position, settings, last_t, last):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Cleaned forces of the samples from `first` on, and the newest sample that was cleaned (-1: none)."""
    half, delay, variance, doubt = settings
    out = np.empty((t.shape[0] - first, 3))
    current, used = last.copy(), -1
    for i in range(first, t.shape[0]):
        at = used
        while at + 1 < i and t[at + 1] <= t[i] - delay:
            at += 1
        if at > used:
            dt = t[at] - last_t if last_t >= 0.0 else 0.0
            current = _clean(p, c, dt, force[at], _motion(pt, position, t[at], half), variance, doubt)
            used, last_t = at, t[at]
        out[i - first] = current
    return out, used


class CarriageAid:
    """Positions, specific forces in, cleaned specific forces out: sample by sample, or in blocks, with one result."""

    def __init__(self, parameters: CarriageParameters | None = None) -> None:
        self.parameters = parameters or CarriageParameters()
        self._positions: deque[tuple[int, float]] = deque(maxlen=_MOST_POSITIONS)
        self.restart()

    def restart(self) -> None:
        """Forget mounting and specific forces, and go on with the positions."""
        self._covariance = np.diag(_PRIOR)
        self._coefficients = np.zeros((3, 3))
        self._origin: int | None = None
        self._forces: deque[tuple[float, FloatArray]] = deque()
        self._last: tuple[float, FloatArray] | None = None

    def add_position(self, stamp_ns: int, position: float) -> None:
        """A position of the carriage, m; one that is before the newest by a second is a new beginning."""
        if not np.isfinite(position):
            return
        if self._positions and stamp_ns <= self._positions[-1][0]:
            if self._positions[-1][0] - stamp_ns < _NEW_BEGINNING_NS:
                return
            self._positions.clear()
        self._positions.append((stamp_ns, position))

    def add_positions(self, stamp_ns: IntArray, position: FloatArray) -> None:
        """`add_position` for many, m, shape (n,)."""
        newest = self._positions[-1][0] if self._positions else None
        rising = np.diff(stamp_ns, prepend=stamp_ns[:1] - 1 if newest is None else newest) > 0
        if rising.all() and np.isfinite(position).all():
            self._positions.extend(zip(stamp_ns.tolist(), position.tolist(), strict=True))
            return
        for stamp, value in zip(stamp_ns.tolist(), position.tolist(), strict=True):
            self.add_position(stamp, value)

    def clean(self, stamp_ns: int, specific_force: FloatArray) -> FloatArray:
        """Cleaned specific force of `delay_s` ago, m/s^2, shape (3,); NaN where it is not known. Stamps increase."""
        waiting = round(self._forces[0][0] * 1e9) + (self._origin or 0) if self._forces else stamp_ns
        oldest = waiting - round((self.parameters.window_s + _SLACK_S) * 1e9)
        while self._positions and self._positions[0][0] < oldest:
            self._positions.popleft()
        return np.asarray(self.clean_block(np.array([stamp_ns]), specific_force[None])[0])

    def clean_block(self, stamp_ns: IntArray, specific_force: FloatArray) -> FloatArray:
        """The same for samples whose positions have been added, shape (n, 3)."""
        if not len(stamp_ns):
            return np.empty((0, 3))
        if self._origin is None:
            self._origin = int(stamp_ns[0])
        before = np.array([t for t, _ in self._forces])
        t = np.concatenate([before, (stamp_ns - self._origin) * 1e-9])
        force = np.concatenate([np.array([f for _, f in self._forces]).reshape(-1, 3), specific_force])
        places = np.array([stamp for stamp, _ in self._positions], dtype=np.int64)
        p = self.parameters
        last_t, last = self._last if self._last is not None else (-1.0, np.full(3, np.nan))
        out, used = _clean_all(
            self._covariance,
            self._coefficients,
            t,
            np.ascontiguousarray(force),
            len(before),
            (places - self._origin) * 1e-9,
            np.array([position for _, position in self._positions], dtype=np.float64),
            np.array([0.5 * p.window_s, p.delay_s, p.force_deviation**2, p.doubt]),
            last_t,
            last,
        )
        if used >= 0:
            self._last = (float(t[used]), np.array(out[-1]))
        self._forces = deque((float(t[i]), force[i].copy()) for i in range(used + 1, len(t)))
        return np.asarray(out, dtype=np.float64)
