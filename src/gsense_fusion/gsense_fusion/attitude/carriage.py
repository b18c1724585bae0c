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
from numba import njit

from .compiled import require_positive
from .interface import FloatArray, IntArray


@dataclass(frozen=True)
class CarriageParameters:
    """How the acceleration is found and taken off."""

    window_s: float = 0.12
    """s. Small: noise of the encoder (50 um steps: 0.005 m/s^2 at 0.12 s); large: bends fast motion (8 rad/s: 1.6 %)."""
    delay_s: float = 0.08
    """s, age of the cleaned specific force; what it is longer than half the window is the time that a position may take."""
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
_LEAST_POSITIONS = 8


@njit("f8[::1](f8[::1], f8[::1], f8, f8)", cache=True)
def _motion(t, position, at, half):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Acceleration and jerk at `at` of the best cubic within `half` around it; NaN where there are too few positions."""
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
    solution = np.linalg.solve(normal, right)
    out[0] = 2.0 * solution[2] / half**2
    out[1] = 6.0 * solution[3] / half**3
    return out


@njit("f8[::1](f8[:, ::1], f8[:, ::1], f8, f8[::1], f8[::1], f8, f8)", cache=True)
def _clean(p, c, dt, force, motion, variance, doubt):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """One step of the regression (covariance p, coefficients c: 3 axes x [1, acceleration, jerk]); the cleaned force."""
    out = np.full(3, np.nan)
    if not (np.isfinite(motion).all() and np.isfinite(force).all()):
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


@njit("f8[:, ::1](f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1], f8[::1], f8[::1], f8, f8, f8, f8)", cache=True)
def _clean_all(p, c, t, force, pt, position, half, delay, variance, doubt):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    out = np.full((t.shape[0], 3), np.nan)
    at, before = -1, -1
    for i in range(t.shape[0]):
        while at + 1 < i and t[at + 1] <= t[i] - delay:
            at += 1
        if at < 0:
            continue
        if at == before:
            out[i] = out[i - 1]
            continue
        dt = 0.0 if before < 0 else t[at] - t[before]
        out[i] = _clean(p, c, dt, force[at], _motion(pt, position, t[at], half), variance, doubt)
        before = at
    return out


class CarriageAid:
    """Positions and specific forces in, cleaned specific forces out, sample by sample."""

    def __init__(self, parameters: CarriageParameters | None = None) -> None:
        self.parameters = parameters or CarriageParameters()
        self.reset()

    def reset(self) -> None:
        """Forget all but the parameters."""
        self._covariance = np.diag(_PRIOR)
        self._coefficients = np.zeros((3, 3))
        self._origin: int | None = None
        self._positions: deque[tuple[int, float]] = deque(maxlen=4096)
        self._forces: deque[tuple[float, FloatArray]] = deque()
        self._last: tuple[float, FloatArray] | None = None

    def add_position(self, stamp_ns: int, position: float) -> None:
        """A position of the carriage, m; one that is not younger than the newest is left out."""
        if np.isfinite(position) and (not self._positions or stamp_ns > self._positions[-1][0]):
            self._positions.append((stamp_ns, position))

    def clean(self, stamp_ns: int, specific_force: FloatArray) -> FloatArray:
        """Cleaned specific force of `delay_s` ago, m/s^2, shape (3,); NaN where it is not known. Stamps increase."""
        if self._origin is None:
            self._origin = stamp_ns
        now = (stamp_ns - self._origin) * 1e-9
        self._forces.append((now, specific_force))
        sample: tuple[float, FloatArray] | None = None
        while self._forces and self._forces[0][0] <= now - self.parameters.delay_s:
            sample = self._forces.popleft()
        if sample is None:
            return self._last[1] if self._last is not None else np.full(3, np.nan)
        at, force = sample
        p = self.parameters
        t, position = self._recent(at)
        motion = _motion(t, position, at, 0.5 * p.window_s)
        dt = 0.0 if self._last is None else at - self._last[0]
        cleaned = _clean(self._covariance, self._coefficients, dt, force, motion, p.force_deviation**2, p.doubt)
        self._last = (at, cleaned)
        return np.asarray(cleaned, dtype=np.float64)

    def _recent(self, at: float) -> tuple[FloatArray, FloatArray]:
        """Positions of the window and after, older ones are dropped."""
        origin = self._origin or 0
        oldest = origin + round((at - self.parameters.window_s) * 1e9)
        while self._positions and self._positions[0][0] < oldest:
            self._positions.popleft()
        t = np.array([(stamp - origin) * 1e-9 for stamp, _ in self._positions], dtype=np.float64)
        return t, np.array([position for _, position in self._positions], dtype=np.float64)

    def clean_all(
        self, stamp_ns: IntArray, specific_force: FloatArray, position_stamp_ns: IntArray, position: FloatArray
    ) -> FloatArray:
        """The same for a recording from its start, shape (n, 3)."""
        if not len(stamp_ns):
            return np.empty((0, 3))
        self.reset()
        p = self.parameters
        origin = stamp_ns[0]
        return np.asarray(
            _clean_all(
                self._covariance,
                self._coefficients,
                (stamp_ns - origin) * 1e-9,
                np.ascontiguousarray(specific_force, dtype=np.float64),
                (position_stamp_ns - origin) * 1e-9,
                np.ascontiguousarray(position, dtype=np.float64),
                0.5 * p.window_s,
                p.delay_s,
                p.force_deviation**2,
                p.doubt,
            ),
            dtype=np.float64,
        )
