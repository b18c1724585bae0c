"""What the accelerometer adds to the likelihood: a carriage that truly turns turns gravity, a pick-up does not.

The accelerometer's answer to the carriage's acceleration is a short power series in frequency, whatever its scale,
misalignment, filter and delay: acceleration, jerk and further derivatives. A turn that follows position or speed
has negative powers, which no such error can imitate. Everything that accelerometers really do is integrated out with
coefficients of its own on each axis, and where the drive's orders are still not explained the noise is taken as that
much larger.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gsense_fusion.identification.campaign import Campaign, RunData
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.effects.design import Mixed
from gsense_fusion.identification.felt.orders import OrderProjection, project_orders
from gsense_fusion.identification.kept import kept
from gsense_fusion.identification.likelihood.gram import Columns, Gram
from gsense_fusion.identification.likelihood.store import DELAY, fields_of
from gsense_fusion.identification.noise.spectrum import NoiseModel, fit_noise
from gsense_fusion.identification.types import FloatArray, IntArray

if TYPE_CHECKING:
    from gsense_fusion.identification.likelihood.model import Fit

MIN_REST_S = 10.0
RUN_DELAY_S = 5e-5
"""How well the delay of a single run is known beyond the campaign's, standard deviation."""
FILTER_PART = 0.25
"""The sensor's filter is taken to have its corner above this part of the sample rate."""
DERIVATIVES = 4
"""Of the acceleration beyond the jerk that a filter's power series needs."""
KEPT_ROWS = 40
PRIOR_ORDINATES = 6.0
"""Weight of the noise at rest beside the half-orders of a run."""
CROSS_AXIS = 0.05
"""Part of the acceleration that an axis across the rail feels at least: cross-axis sensitivity, mounting."""
FEWEST_DEGREES = 3.0
LARGEST_LEVEL = 30.0
"""An order with more than this times the noise's power is not understood, and not used."""


@dataclass(frozen=True, eq=False)
class _FeltRun:
    """One run's orders, sensor axes."""

    data: RunData
    along: FloatArray
    """The rail's direction, shape (3,)."""
    projection: OrderProjection
    sigma: FloatArray
    """Of each row on each axis, from rest, m/s^2, shape (rows, 3)."""
    rest: FloatArray
    """Specific force without the encoder's motion through the mounting, m/s^2, shape (rows, 3)."""
    nuisance: FloatArray
    """Flat and tolerated columns of every axis, shape (rows, q)."""
    turning: FloatArray
    """What turns may look like on any axis: for judging what is left, shape (rows, r)."""

    @property
    def order(self) -> IntArray:
        """Order of each row, shape (rows,); half-orders are rounded."""
        return np.rint(np.tile(self.projection.orders, 2)).astype(np.int64)


class ForceChannel:
    """Normal equations of the accelerometer in all effects' parameters, everything else integrated out."""

    def __init__(self, campaign: Campaign, source: DriverSource, effects: tuple[Effect, ...]) -> None:
        """Reduce the fit runs; without an accelerometer, an encoder or rest the channel stays empty."""
        self._effects = tuple(e for e in effects if type(e).felt is not Effect.felt)
        self._columns = Columns.of(effects)
        self._source = source
        self._rows = kept(KEPT_ROWS, self._rows_of)
        self._sums = kept(KEPT_ROWS, self._sum)
        self.noise = rest_noise(campaign)
        self.runs: tuple[_FeltRun, ...] = ()
        if self._effects and self.noise:
            made = (_reduce(r, source, self.noise) for r in campaign.fit)
            self.runs = tuple(r for r in made if r is not None)
        self._fields = frozenset(f for e in self._effects for f in fields_of(e)) - {DELAY}
        self._axes = _axes(self.runs)
        self.levels: Mapping[int, FloatArray] = {a: axis.level for a, axis in self._axes.items()}
        """By sensor axis: times the noise at rest that each order has, NaN where it is not used, shape (orders,)."""

    @property
    def decides(self) -> bool:
        """Whether the channel says anything."""
        return any(np.isfinite(level).any() for level in self.levels.values())

    def grams(self, names: frozenset[str], templates: Templates) -> dict[int, Gram]:
        """By mounting; zero in all columns that do not turn the carriage."""
        wanted = frozenset(e.name for e in self._effects if e.name in names)
        return self._sums(wanted, templates.only(self._fields)) if self.decides else {}

    def loglik(self, fit: Fit, beta: FloatArray | None = None) -> float:
        """Log-likelihood of the accelerometer under a fit, or under other coefficients (P,) of its model."""
        beta = fit.beta if beta is None else beta
        grams = self.grams(fit.names, fit.templates).values()
        return -0.5 * sum(float(g.yy - 2 * beta @ g.xy + beta @ g.xx @ beta) for g in grams)

    def _sum(self, names: frozenset[str], templates: Templates) -> dict[int, Gram]:
        index = self._columns.index(names)
        effects = [e for e in self._effects if e.name in names]
        parts = [self._rows(e, templates.only(fields_of(e) - {DELAY})) for e in effects]
        out: dict[int, Gram] = {}
        for axis, own in self._axes.items():
            for mounting, block in own.blocks.items():
                columns = [
                    np.concatenate([np.zeros((len(keep), 0)), *(p[i][keep, axis, :] for p in parts)], axis=1)
                    for i, keep in zip(block.runs, block.keep, strict=True)
                ]
                small = block.gram(np.concatenate(columns))
                xx, xy = np.zeros((self._columns.total, self._columns.total)), np.zeros(self._columns.total)
                xx[np.ix_(index, index)], xy[index] = small.xx, small.xy
                gram = Gram(xx, xy, small.yy, small.rows)
                out[mounting] = out[mounting] + gram if mounting in out else gram
        return out

    def _rows_of(self, effect: Effect, templates: Templates) -> tuple[FloatArray, ...]:
        """Orders of an effect's columns by run, shape (rows, 3, p)."""
        rows = []
        for run in self.runs:
            felt = effect.felt(self._source.of(run.data, templates))
            shape = (len(run.rest), 3, len(effect.parameters))
            rows.append(np.zeros(shape) if felt is None else run.projection.of_design(Mixed.of(felt)))
        return tuple(rows)


def rest_noise(campaign: Campaign) -> dict[int, NoiseModel]:
    """Noise model of each accelerometer axis, (m/s^2)^2/Hz, from rest; empty where there is too little."""
    if not any(r.motion is not None and r.motion.angular_frequency is not None for r in campaign.fit):
        return {}
    still = [(r, w) for r in campaign.fit for w in r.windows if not w.moving and len(w) >= r.run.rate_hz]
    still = [(r, w) for r, w in still if np.isfinite(r.run.specific_force).all()]
    if sum(len(w) / r.run.rate_hz for r, w in still) < MIN_REST_S:
        return {}
    return {
        axis: fit_noise([r.run.specific_force[w.start : w.stop, axis] for r, w in still], campaign.rate_hz)
        for axis in range(3)
    }


def _reduce(data: RunData, source: DriverSource, noise: Mapping[int, NoiseModel]) -> _FeltRun | None:
    projection = project_orders(data)
    drivers = source.of(data, Templates())
    force = drivers.specific_force
    if projection is None or force is None or data.mounting is None or data.mounting.along is None:
        return None
    if not np.isfinite(data.run.specific_force).all():
        return None
    rate = data.run.rate_hz
    f = projection.frequency_hz
    sigma = np.stack([projection.spread * np.sqrt(noise[a].psd(f) * rate / 2) for a in range(3)], axis=1)
    rest = projection.of(data.run.specific_force - force)
    between = ((rest / sigma) ** 2)[~projection.whole]
    # half-orders belong to nothing: a run that shakes more than the table at rest counts for less
    shaken = (between.sum(axis=0) + PRIOR_ORDINATES) / (len(between) + PRIOR_ORDINATES)
    sigma = sigma * np.sqrt(np.maximum(shaken, 1.0))
    kin = drivers.kinematics
    a, s, v = (projection.of(x) for x in (kin.acceleration, kin.position, kin.velocity))
    direction = projection.of(np.tanh(kin.velocity / 2e-3))
    jerk = projection.derivative(a)
    tau = max(abs(data.delay_s), 1.0 / (2 * np.pi * FILTER_PART * rate))
    series, further = [], jerk
    for k in range(2, 2 + DERIVATIVES):
        further = projection.derivative(further)
        series.append(further * tau**k)
    stretch = projection.derivative(projection.derivative(direction))
    squares = [projection.of(kin.acceleration**2), projection.of(kin.acceleration * kin.velocity)]
    nuisance = np.stack([a, jerk, *squares, direction, stretch, *series], axis=1)
    turning = np.stack([s, v, projection.of(kin.position**2), projection.of(kin.velocity**2)], axis=1)
    return _FeltRun(data, data.mounting.along, projection, sigma, rest, nuisance, turning)


FLAT = 6
"""The first columns of the nuisance have no prior: scale and misalignment, delay, squares, direction, stretch."""


@dataclass(frozen=True, eq=False)
class _Block:
    """One axis of the runs of one mounting: whitened rows with the nuisance's projector."""

    runs: tuple[int, ...]
    keep: tuple[IntArray, ...]
    """Rows of each run that are used."""
    order: IntArray
    """Of each row, shape (rows,)."""
    weight: FloatArray
    span: FloatArray
    """Directions that the nuisance takes, (rows, q): y - span span' y is left of y, more of it where it has a prior."""
    y: FloatArray

    def gram(self, X: FloatArray) -> Gram:
        """Normal equations of columns (rows, p), nuisance integrated out."""
        both = np.column_stack([X * self.weight[:, None], self.y])
        inside = self.span.T @ both
        full = both.T @ both - inside.T @ inside
        return Gram(full[:-1, :-1], full[:-1, -1], float(full[-1, -1]), len(self.y))


@dataclass(frozen=True, eq=False)
class _Axis:
    level: FloatArray
    blocks: Mapping[int, _Block]


def _axes(runs: Sequence[_FeltRun]) -> dict[int, _Axis]:
    """Each sensor axis with its noise in motion."""
    out: dict[int, _Axis] = {}
    if not runs:
        return out
    top = max(int(r.order[r.projection.whole].max()) for r in runs)
    for axis in range(3):
        level = _level(_blocks(runs, axis, np.ones(top), turning=True), top)
        out[axis] = _Axis(level, _blocks(runs, axis, level))
    return out


def _blocks(runs: Sequence[_FeltRun], axis: int, level: FloatArray, turning: bool = False) -> dict[int, _Block]:
    """Whitened rows by mounting at a level of noise by order; `turning`: with any turn among the nuisance."""
    out: dict[int, _Block] = {}
    for mounting in sorted({r.data.mounting_number or 0 for r in runs}):
        members = tuple(i for i, r in enumerate(runs) if (r.data.mounting_number or 0) == mounting)
        keep, weight, basis, y, order = [], [], [], [], []
        for place, run in enumerate(runs[i] for i in members):
            within = run.projection.whole & (run.order <= len(level))
            rows = np.flatnonzero(within & np.isfinite(level[np.minimum(run.order, len(level)) - 1]))
            own = 1.0 / (run.sigma[rows, axis] * np.sqrt(level[run.order[rows] - 1]))
            late = np.zeros((len(rows), len(members)))
            late[:, place] = run.nuisance[rows, 1] * RUN_DELAY_S
            response = max(abs(float(run.along[axis])), CROSS_AXIS)
            parts = [run.nuisance[rows, :FLAT], run.turning[rows] if turning else np.zeros((len(rows), 0))]
            parts += [run.nuisance[rows, FLAT:] * response, late * response]
            basis.append(np.concatenate(parts, axis=1) * own[:, None])
            keep.append(rows)
            weight.append(own)
            y.append(run.rest[rows, axis] * own)
            order.append(run.order[rows])
        free = FLAT + (runs[0].turning.shape[1] if turning else 0)
        span = _span(np.concatenate(basis), free)
        out[mounting] = _Block(
            members, tuple(keep), np.concatenate(order), np.concatenate(weight), span, np.concatenate(y)
        )
    return out


def _span(basis: FloatArray, free: int) -> FloatArray:
    """Directions of a basis (rows, q) that has `free` columns without a prior, the others with one of unit variance."""
    prior = np.concatenate([np.zeros(free), np.ones(basis.shape[1] - free)])
    size = np.sqrt(np.sum(basis**2, axis=0) + prior)
    unit = basis / np.where(size > 0, size, 1.0)
    inner = unit.T @ unit + np.diag(prior / np.where(size > 0, size, 1.0) ** 2)
    values, vectors = np.linalg.eigh(inner)
    good = values > 1e-10
    return np.asarray(unit @ vectors[:, good] / np.sqrt(values[good]))


def _level(blocks: Mapping[int, _Block], top: int) -> FloatArray:
    """Power of what no turn and no error of an accelerometer explains, over the expected noise, by order, (top,)."""
    square, degrees = np.zeros(top), np.zeros(top)
    for block in blocks.values():
        rest = block.y - block.span @ (block.span.T @ block.y)
        left = 1.0 - np.sum(block.span**2, axis=1)
        for i in range(top):
            mine = block.order == i + 1
            square[i] += float(np.sum(rest[mine] ** 2))
            degrees[i] += float(np.sum(left[mine]))
    found = np.where(degrees > 0, square / np.maximum(degrees, 1e-9), np.inf)
    # where the noise itself is an estimate from few degrees, a large likelihood ratio is less rare
    found = np.where(found > 1.0, 1.0 + (found - 1.0) * (1.0 + np.sqrt(2.0 / np.maximum(degrees, 1.0))), 1.0)
    return np.asarray(np.where((degrees >= FEWEST_DEGREES) & (found < LARGEST_LEVEL), found, np.nan))
