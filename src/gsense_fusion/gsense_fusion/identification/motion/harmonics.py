"""Periodic motion: harmonics of the drive, fitted to a record and differentiated analytically."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gsense_fusion.identification.motion.phasors import Phasors, powers
from gsense_fusion.identification.types import ComplexArray, FloatArray, IntArray

HIGHEST_HARMONIC_HZ = 20.0
MAX_HARMONICS = 128
KEEP_SIGMA = 5.0
WORST_CONDITION = 1e4
"""Of the orders' normal matrix. Whole periods have some tens; where gaps leave a part of every period out, a sum of
many orders can be anything there."""
ROUNDED = 1e-12
"""Of a series: what its sums are rounded to, which repeats and is no order."""
LOCKED_PART = 0.2
"""Of the deviation that rounding to counts makes: what stays in each order, as it repeats with the drive."""


@dataclass(frozen=True, eq=False)
class Kinematics:
    """Motion along the rail at given times, each of shape (n,)."""

    position: FloatArray
    """m."""
    velocity: FloatArray
    """m/s."""
    acceleration: FloatArray
    """m/s^2."""
    jerk: FloatArray
    """m/s^3."""

    @staticmethod
    def at_rest(position: float, n: int) -> Kinematics:
        """A carriage that stands at `position`."""
        zero = np.zeros(n)
        return Kinematics(np.full(n, position), zero, zero, zero)


@dataclass(frozen=True)
class Harmonics:
    """s(t) = offset + sum_h c_h cos(h w t) + d_h sin(h w t), t from `origin`."""

    angular_frequency: float
    origin: float
    offset: float
    orders: FloatArray
    cosine: FloatArray
    sine: FloatArray
    residual_rms: float
    stderr: float = 0.0
    """Of each amplitude, m: counts are rounded alike in every period, which no averaging takes out."""

    @property
    def amplitude(self) -> float:
        """Amplitude of the fundamental in m."""
        first = self.orders == 1
        return float(np.hypot(self.cosine[first].sum(), self.sine[first].sum()))

    def lowest(self, order: int) -> Harmonics:
        """The same without orders above one."""
        keep = self.orders <= order
        return replace(self, orders=self.orders[keep], cosine=self.cosine[keep], sine=self.sine[keep])

    def at(self, time: FloatArray) -> Kinematics:
        """Position and its analytic derivatives at the times (n,)."""
        position, velocity, acceleration, jerk = self._derivatives(time, (0, 1, 2, 3))
        return Kinematics(self.offset + position, velocity, acceleration, jerk)

    def position_at(self, time: FloatArray) -> FloatArray:
        """Position alone."""
        return np.asarray(self.offset + self._derivatives(time, (0,))[0])

    def acceleration_at(self, time: FloatArray) -> FloatArray:
        """Acceleration alone."""
        return np.asarray(self._derivatives(time, (2,))[0])

    def _derivatives(self, time: FloatArray, which: tuple[int, ...]) -> FloatArray:
        """Derivatives of the oscillation by time, shape (len(which), n)."""
        if not len(self.orders):
            return np.zeros((len(which), len(time)))
        orders = np.rint(self.orders).astype(np.int64)
        # c cos + d sin is the real part of (c - i d) exp(i phase), whose derivative has the factor i w
        size = (self.cosine - 1j * self.sine) * (1j * self.angular_frequency * self.orders) ** np.array(which)[:, None]
        return Phasors.of(self.angular_frequency * (time - self.origin)).oscillation(size, orders)


def fit_harmonics(time: FloatArray, position: FloatArray, guess: float) -> Harmonics:
    """Least squares of the drive's harmonics with its frequency; harmonics under 5 sigma are dropped.

    Args:
        time: s, shape (n,).
        position: m, shape (n,).
        guess: Angular frequency in rad/s, within about 1/duration of the truth.

    """
    origin = float(time.mean())
    t = time - origin
    w = guess
    for _ in range(8):
        X = _columns(t, w, 3)
        beta = least_squares(X, position)
        slope = X[:, 4:7] @ (beta[1:4] * np.arange(1, 4)) * -1.0 + X[:, 1:4] @ (beta[4:7] * np.arange(1, 4))
        both = least_squares(np.column_stack([X, t * slope]), position)
        w += float(both[-1])
        if abs(both[-1]) < 1e-9 * w:
            break
    rate = 1.0 / float(np.median(np.diff(time)))
    highest = min(MAX_HARMONICS, int(min(HIGHEST_HARMONIC_HZ, 0.4 * rate) * 2 * np.pi / w), len(t) // 8)
    return _keep_significant(t, position, w, max(1, highest), origin)


def refined_guess(time: FloatArray, position: FloatArray, guess: float) -> float:
    """Angular frequency in rad/s of the likeliest sine about a guess that the line through a gap has bent.

    Args:
        time: s, shape (n,), with gaps.
        position: m, shape (n,).
        guess: rad/s.

    """
    t = time - time.mean()
    tried = np.arange(0.5 * guess, 2.0 * guess, 0.5 / float(np.ptp(t)))
    sines = [_columns(t, w, 1) for w in tried]
    left = [float(np.sum((position - X @ least_squares(X, position)) ** 2)) for X in sines]
    return float(tried[int(np.argmin(left))])


def _keep_significant(t: FloatArray, position: FloatArray, w: float, highest: int, origin: float) -> Harmonics:
    phasors, orders = Phasors.of(w * t), np.arange(1, highest + 1)
    while len(orders) > 1 and np.linalg.cond(phasors.normal_matrix(orders), 1) > WORST_CONDITION:
        orders = orders[: len(orders) // 2]
    for _ in range(2):
        fit = _fit_orders(phasors, position, orders)
        keep = np.abs(fit.size) > KEEP_SIGMA * fit.rms * np.sqrt(2.0 / len(t))
        keep[0] = True
        if keep.all():
            break
        orders = orders[keep]
    else:
        fit = _fit_orders(phasors, position, orders)
    stderr = max(fit.rms * float(np.sqrt(2.0 / len(t))), LOCKED_PART * fit.rms)
    return Harmonics(w, origin, fit.offset, orders.astype(float), fit.size.real, fit.size.imag, fit.rms, stderr)


@dataclass(frozen=True, eq=False)
class _Orders:
    """Least squares of a series by some orders."""

    offset: float
    size: ComplexArray
    """Cosine amplitudes, and the sines' as imaginary part, shape (k,)."""
    rms: float
    """Standard deviation of what is left."""


def _fit_orders(phasors: Phasors, series: FloatArray, orders: IntArray) -> _Orders:
    k = len(orders)
    right = phasors.sums(series[None], orders)[0]
    # harmonics over whole periods are nearly orthogonal
    beta = np.linalg.solve(phasors.normal_matrix(orders), np.concatenate([[series.sum()], right.real, right.imag]))
    size = beta[1 : 1 + k] - 1j * beta[1 + k :]
    rest = series - beta[0] - phasors.oscillation(size[None], orders)[0]
    rms = max(float(np.std(rest)), ROUNDED * float(np.std(series)))
    return _Orders(float(beta[0]), size.conj(), rms)


def least_squares(X: FloatArray, y: FloatArray) -> FloatArray:
    """By the normal equations of columns of unit length: for a few columns that are far from parallel, and fast."""
    scale = np.sqrt(np.sum(X**2, axis=0))
    unit = X / np.where(scale > 0, scale, 1.0)
    beta, *_ = np.linalg.lstsq(unit.T @ unit, unit.T @ y, rcond=None)
    return np.asarray(beta / np.where(scale > 0, scale, 1.0).reshape(-1, *[1] * (y.ndim - 1)))


def _columns(t: FloatArray, w: float, highest: int) -> FloatArray:
    turned = powers(w * t, highest)
    return np.concatenate([turned.real, turned.imag[1:]]).T
