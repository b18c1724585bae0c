"""The magnetometer in motion: field over the carriage's position (steel), field of the motor's current.

Both belong to the rig, so they are fitted in the rail's axes: B = B0(run) + drift(run) t + sum_k p_k P_k(s / L) +
M (1 + g s) i, with Legendre polynomials P_k and the magnetometer's own lag in s and i; g where the board comes so near
to the motor that its field changes on the way. Constants of each run take hard iron, the earth's field and the
mounting's attitude out of it. Where no topic tells the motor's current, acceleration, speed and its sign stand for it
(inertia, damping, friction).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.polynomial import legendre

from gsense_fusion.identification.campaign import Campaign, RunData
from gsense_fusion.identification.kept import kept
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.types import FloatArray, IntArray

HIGHEST_ORDER = 6
LAGS_S = tuple(float(x) for x in np.linspace(-0.02, 0.2, 221))
"""Tried: a magnetometer that measures ten times a second is up to a tenth late, and its filter adds to it; an encoder
whose stamps are late makes it early. Steel that is some milliseconds off follows the speed, as the motor does."""
LAG_NUMBERS = range(len(LAGS_S))
COARSE = 10
"""Of the lags, every how many are tried first."""
GRID_S = 0.01
"""s between the places where the motion is made; a chord errs by 1e-3 at 8 rad/s, the lag's step by more."""
FRICTION_SPEED = 0.02
"""m/s over which friction changes its sign."""
ORDERS = (1, 2, 3)
OWN_ORDERS = 6
MIN_MESSAGES = 60
MIN_REST_MESSAGES = 40
MAX_CORRELATION = 0.9
PROXIES = ("acceleration", "friction", "speed")


@dataclass(frozen=True, eq=False)
class FieldRun:
    """Messages of one run."""

    data: RunData
    time: FloatArray
    """s, shape (k,)."""
    field: FloatArray
    """T, shape (k, 3), rail axes (sensor axes where no rotation is known)."""

    @cached_property
    def swing(self) -> FloatArray:
        """The field without its mean and drift, T, shape (k, 3)."""
        return without_drift(self.time, self.field)

    @cached_property
    def _course(self) -> tuple[FloatArray, Kinematics] | None:
        """Instants, shape (g,), and the motion at them; None where nothing moves."""
        if self.data.motion is None:
            return None
        grid = np.arange(self.time.min() - LAGS_S[-1], self.time.max() - LAGS_S[0] + GRID_S, GRID_S)
        return grid, self.data.motion.at(grid)

    def moved(self, lag: int) -> FloatArray:
        """Position, velocity and acceleration that the messages show with the lag of that number, (3, k)."""
        if self._course is None:
            return np.zeros((3, len(self.time)))
        grid, kin = self._course
        late = self.time - LAGS_S[lag]
        return np.stack([np.interp(late, grid, x) for x in (kin.position, kin.velocity, kin.acceleration)])

    @property
    def angular_frequency(self) -> float | None:
        """Of the drive, rad/s."""
        return None if self.data.motion is None else self.data.motion.angular_frequency


@dataclass(frozen=True)
class Model:
    """Which terms: the order of the polynomial over position (0: none), the motor or not, the lag's number."""

    order: int
    motor: bool
    lag: int = 0
    nearing: bool = False
    """The motor's field changes with the board's distance from it: M (1 + g s) i."""


@dataclass(frozen=True, eq=False)
class FieldFit:
    """A model with its coefficients."""

    model: Model
    loglik: float
    score: float
    beta: FloatArray
    """T per unit of each column, shape (p, 3); zero where a column is not in the model."""
    covariance: FloatArray
    """Of one axis' coefficients, shape (p, p)."""


@dataclass(frozen=True, eq=False)
class _Gram:
    xx: FloatArray
    xy: FloatArray


class Magnetometer:
    """All moving runs' fields with their drivers."""

    def __init__(
        self, runs: Sequence[FieldRun], reach: float, motor_unit: str | None, still: Sequence[FieldRun]
    ) -> None:
        """Take the runs; `reach` is the largest distance from the rail's middle in m."""
        self.runs = tuple(runs)
        self.reach = reach
        self.motor_unit = motor_unit
        self.motor_columns = 1 if motor_unit is not None else len(PROXIES)
        self.rows = sum(len(r.time) for r in runs)
        self.variance = self._level(still)
        """T^2 of one axis and message, blown up for what neighbours have in common."""
        self.grams = kept(None, self._grams)
        self.sums = kept(None, self._sums)

    @staticmethod
    def of(campaign: Campaign) -> Magnetometer | None:
        """From a campaign; None where no run in motion has enough messages."""
        moving: list[FieldRun] = []
        still: list[FieldRun] = []
        mountings = {r.mounting_number for r in campaign.runs if r.motion is not None and r.motion.moving is not None}
        for data in campaign.runs:
            found = _field_run(data, alone=len(mountings) <= 1)
            if found is not None:
                rest = data.motion is None or data.motion.moving is None
                (still if rest else moving).append(found)
        if not moving:
            return None
        reach = max(float(np.max(np.abs(r.moved(0)[0]))) for r in moving)
        units = {None if r.data.run.motor is None else r.data.run.motor.unit for r in moving}
        return Magnetometer(moving, reach, units.pop() if len(units) == 1 else None, still)

    def columns(self, run: FieldRun, lag: int) -> FloatArray:
        """Polynomials over position, motor, motor times position, shape (k, HIGHEST_ORDER + 2 motor_columns)."""
        position, velocity, acceleration = run.moved(lag)
        shape = legendre.legvander(position / self.reach, HIGHEST_ORDER)[:, 1:]
        motor = run.data.run.motor
        if self.motor_unit is not None and motor is not None:
            drive = np.interp(run.time - LAGS_S[lag], motor.time, motor.value)[:, None]
        else:
            drive = np.column_stack([acceleration, np.tanh(velocity / FRICTION_SPEED), velocity])
        return np.concatenate([shape, drive, drive * (position / self.reach)[:, None]], axis=1)

    def _grams(self, lag: int) -> tuple[_Gram, ...]:
        out = []
        for run in self.runs:
            X = without_drift(run.time, self.columns(run, lag))
            out.append(_Gram(X.T @ X, X.T @ run.swing))
        return tuple(out)

    def _sums(self, lag: int, leave_out: int | None) -> tuple[FloatArray, FloatArray]:
        grams = [g for i, g in enumerate(self.grams(lag)) if i != leave_out]
        return np.sum([g.xx for g in grams], axis=0), np.sum([g.xy for g in grams], axis=0)

    @cached_property
    def total(self) -> float:
        """Sum of squares without each run's constant and drift, T^2."""
        return sum(float(np.sum(r.swing**2)) for r in self.runs)

    def index(self, model: Model) -> IntArray:
        """Columns of a model."""
        count = self.motor_columns * (1 + model.nearing) if model.motor else 0
        return np.concatenate([np.arange(model.order), HIGHEST_ORDER + np.arange(count)]).astype(np.int64)

    def fit(self, model: Model, leave_out: int | None = None) -> FieldFit:
        """Least squares of a model, on all runs or all but one."""
        xx, xy = self.sums(model.lag, leave_out)
        at = self.index(model)
        beta = np.zeros((HIGHEST_ORDER + 2 * self.motor_columns, 3))
        covariance = np.zeros((len(beta), len(beta)))
        gain = 0.0
        if len(at):
            inverse = np.linalg.pinv(xx[np.ix_(at, at)], rcond=1e-10, hermitian=True)
            beta[at] = inverse @ xy[at]
            covariance[np.ix_(at, at)] = inverse * self.variance
            gain = float(np.sum(beta[at] * xy[at]))
        loglik = 0.5 * (gain - self.total) / self.variance
        cost = (3 * len(at) + (len(at) > 0)) * float(np.log(max(self.rows, 2)))
        return FieldFit(model, loglik, 2 * loglik - cost, beta, covariance)

    def best(self, position: bool, motor: bool) -> FieldFit:
        """The best model with position, motor, both or none of them, by BIC over order and lag."""
        if not position and not motor:
            return self.fit(Model(0, False))
        orders = range(1, HIGHEST_ORDER + 1) if position else (0,)
        plain = max(
            (self.fit(Model(k, motor, i)) for k in orders for i in LAG_NUMBERS[::COARSE]), key=lambda f: f.score
        )
        near = LAG_NUMBERS[max(plain.model.lag - COARSE, 0) : plain.model.lag + COARSE + 1]
        plain = max((self.fit(Model(k, motor, i)) for k in orders for i in near), key=lambda f: f.score)
        if not motor:
            return plain
        nearer = (self.fit(Model(k, motor, plain.model.lag, nearing=True)) for k in orders)
        return max(plain, *nearer, key=lambda f: f.score)

    def lag_error(self, fit: FieldFit) -> float:
        """Standard error of a model's lag, s: from the parabola through its likelihood, and the step between lags."""
        step = LAGS_S[1] - LAGS_S[0]
        low, high = (min(max(fit.model.lag + k, 0), LAG_NUMBERS[-1]) for k in (-COARSE, COARSE))
        sides = [self.fit(replace(fit.model, lag=i)).loglik for i in (low, high)]
        fall = max(fit.loglik - float(np.mean(sides)), 1e-12)
        return float(np.hypot((high - low) / 2 * step / np.sqrt(2 * fall), step / np.sqrt(12.0)))

    def holds(self, fit: FieldFit, without: FieldFit) -> bool:
        """Whether, on every run left out in turn, the larger model errs less in sum."""
        if len(self.runs) < 2:
            return True
        return self._left_out(fit.model) < self._left_out(without.model)

    def _left_out(self, model: Model) -> float:
        error = 0.0
        for i, gram in enumerate(self.grams(model.lag)):
            beta = self.fit(model, leave_out=i).beta
            error += float(np.sum(beta * (gram.xx @ beta)) - 2 * np.sum(beta * gram.xy))
        return error

    def locked(self, fit: FieldFit) -> tuple[float, int]:
        """Energy of the residual at the drive's lowest orders over its expectation, and its degrees of freedom."""
        energy, degrees = 0.0, 0
        for run in self.runs:
            w = run.angular_frequency
            if w is None:
                continue
            rest = self.residual(run, fit)
            for order in ORDERS:
                X = without_drift(run.time, _tone(run.time, order * w))
                beta, *_ = np.linalg.lstsq(X, rest, rcond=1e-8)
                energy += float(np.sum((X @ beta) ** 2)) / self.variance
                degrees += 6
        return energy, degrees

    def residual(self, run: FieldRun, fit: FieldFit) -> FloatArray:
        """Field of a run without its constant, drift and model, T, shape (k, 3)."""
        return without_drift(run.time, run.field - self.columns(run, fit.model.lag) @ fit.beta)

    def _level(self, still: Sequence[FieldRun]) -> float:
        """Variance of a message from rest, and from between the drive's orders: the larger of the two."""
        rest = [without_drift(r.time, r.field) for r in still if len(r.time) >= MIN_REST_MESSAGES]
        moving = [_between_orders(r) for r in self.runs if r.angular_frequency is not None]
        return max(_independent(rest), _independent(moving), 1e-22)


def _independent(series: Sequence[FloatArray]) -> float:
    """Mean variance of (k, 3) series, times what the likeness of neighbours takes from their number."""
    if not series:
        return 0.0
    square = float(np.concatenate(series).var())
    product = float(np.mean(np.concatenate([x[1:] * x[:-1] for x in series])))
    likeness = float(np.clip(product / max(square, 1e-30), 0.0, MAX_CORRELATION))
    return square * (1.0 + likeness) / (1.0 - likeness)


def _between_orders(run: FieldRun) -> FloatArray:
    w = run.angular_frequency or 0.0
    X = np.concatenate([_tone(run.time, order * w) for order in range(1, OWN_ORDERS + 1)], axis=1)
    X, Y = without_drift(run.time, X), without_drift(run.time, run.field)
    beta, *_ = np.linalg.lstsq(X, Y, rcond=1e-8)
    free = max(len(Y) - X.shape[1] - 2, 1)
    return np.asarray((Y - X @ beta) * np.sqrt(len(Y) / free))


def _tone(time: FloatArray, w: float) -> FloatArray:
    return np.column_stack([np.cos(w * time), np.sin(w * time)])


def without_drift(time: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (k, p) without their mean and their straight line over time."""
    t = time - time.mean()
    centred = columns - columns.mean(axis=0)
    return np.asarray(centred - np.outer(t, t @ centred) / max(float(t @ t), 1e-30))


def _field_run(data: RunData, *, alone: bool) -> FieldRun | None:
    """Messages within the run; in the rail's axes where they are known, else, of a single mounting, in the sensor's."""
    record = data.run.magnetic
    if record is None:
        return None
    first, last = float(data.run.time[0]), float(data.run.time[-1])
    if data.motion is not None and data.motion.steady is not None:  # ramps are no harmonics of the drive
        first, last = data.motion.steady.start, data.motion.steady.stop
    inside = (record.time >= first) & (record.time <= last)
    rotation = None if data.mounting is None else data.mounting.sensor_from_rail
    if inside.sum() < MIN_MESSAGES or (rotation is None and not alone):
        return None
    field = record.field[inside] if rotation is None else record.field[inside] @ rotation
    return FieldRun(data, record.time[inside], field)
