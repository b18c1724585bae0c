"""Fast part of the likelihood: whitened regressors of each moving window, reduced to small Gram matrices per run.

In the frequency domain stationary noise is independent from bin to bin, so generalised least squares is a division by
the square root of the spectrum. Constant, slope and curvature of each window are projected out: slow things are the
business of `slow`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft

from gsense_fusion.identification.bins import HIGHEST_HZ, Bins, axis_rows, window_bins
from gsense_fusion.identification.campaign import Campaign, DriverSource, Window
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.noise import NoiseModel
from gsense_fusion.identification.store import fields_of, means
from gsense_fusion.identification.types import FloatArray, IntArray
from gsense_fusion.identification.wideband import WideBand

KEPT_ROWS = 80
KEPT_GRAMS = 64


@dataclass(frozen=True)
class Gram:
    """Sums of a linear least-squares problem with unit noise: X'X, X'y, y'y and the number of rows."""

    xx: FloatArray
    xy: FloatArray
    yy: float
    rows: int

    def __add__(self, other: Gram) -> Gram:
        return Gram(self.xx + other.xx, self.xy + other.xy, self.yy + other.yy, self.rows + other.rows)

    @staticmethod
    def zero(p: int) -> Gram:
        """No data yet."""
        return Gram(np.zeros((p, p)), np.zeros(p), 0.0, 0)


@dataclass(frozen=True)
class Columns:
    """Where each effect's parameters stand among the columns."""

    start: Mapping[str, int]
    count: Mapping[str, int]
    total: int
    plausible: FloatArray
    """Plausible size of each parameter, shape (P,)."""

    @staticmethod
    def of(effects: tuple[Effect, ...]) -> Columns:
        """Lay the effects out one after the other."""
        start, count, total = {}, {}, 0
        plausible: list[float] = []
        for effect in effects:
            start[effect.name] = total
            count[effect.name] = len(effect.parameters)
            total += len(effect.parameters)
            plausible.extend(p.plausible for p in effect.parameters)
        return Columns(start, count, total, np.array(plausible))

    def vectors(self, effects: tuple[Effect, ...]) -> tuple[IntArray, ...]:
        """Columns of each vector parameter (same effect, same unit) of some effects."""
        out: list[IntArray] = []
        for effect in effects:
            units = [p.unit for p in effect.parameters]
            for unit in dict.fromkeys(units):
                own = [self.start[effect.name] + i for i, u in enumerate(units) if u == unit]
                out.append(np.array(own, dtype=np.int64))
        return tuple(out)

    def index(self, names: frozenset[str]) -> IntArray:
        """Column numbers of a set of effects."""
        picked = [np.arange(self.start[n], self.start[n] + self.count[n]) for n in self.start if n in names]
        return np.concatenate(picked).astype(np.int64) if picked else np.zeros(0, dtype=np.int64)


def whiten(series: FloatArray, bins: Bins) -> FloatArray:
    """Rows of unit variance from series of shape (n, 3, k): shape (2 * bins, 3, k), real parts first."""
    spectrum = rfft(series, axis=0)[bins.keep] * bins.weight[:, :, None]
    return np.concatenate([spectrum.real, spectrum.imag], axis=0)


def project_out_slow(rows: FloatArray, bins: Bins) -> FloatArray:
    """Remove a constant, a slope and a curvature per axis from whitened rows (2 * bins, 3, k)."""
    out = np.empty_like(rows)
    for axis, q in enumerate(bins.slow):
        out[:, axis, :] = rows[:, axis, :] - q @ (q.T @ rows[:, axis, :])
    return out


class WhitenedCampaign:
    """Gram matrices of the moving windows of the fit runs, and block means, for any template values.

    An effect's columns depend on its own templates and the gyro's delay only, so a new value of one template costs the
    columns of one effect.
    """

    def __init__(
        self,
        campaign: Campaign,
        source: DriverSource,
        effects: tuple[Effect, ...],
        noise: Mapping[int, NoiseModel],
        cuts: Sequence[tuple[int, Window]],
    ) -> None:
        """Take what the columns are made of; `cuts`: blocks of the fit runs, in order of the runs' numbers."""
        self.campaign = campaign
        self.effects = effects
        self.columns = Columns.of(effects)
        self._source = source
        self._noise = noise
        self._blocks = [[w for r, w in cuts if r == number] for number in range(len(campaign.fit))]
        self._windows = [
            [(w, window_bins(len(w), r.run.rate_hz, noise)) for w in r.windows if w.moving] for r in campaign.fit
        ]
        self._wide = WideBand(campaign, source, noise, HIGHEST_HZ)
        self._rows: dict[tuple[str, Templates], tuple[FloatArray, ...]] = {}
        self._means: dict[tuple[str, Templates], FloatArray] = {}
        self._cross: dict[tuple[str, Templates], tuple[FloatArray, ...]] = {}
        self._grams: dict[frozenset[tuple[str, Templates]], tuple[Gram, ...]] = {}
        measured = [self._whiten(i, r.run.angular_rate[:, :, None]) for i, r in enumerate(campaign.fit)]
        default = [self.rows(e, Templates()) for e in effects]
        self._stack = [np.concatenate([*(d[i] for d in default), y], axis=1) for i, y in enumerate(measured)]
        self._base = tuple(_gram(rows) for rows in self._stack)

    def rows(self, effect: Effect, templates: Templates) -> tuple[FloatArray, ...]:
        """Whitened columns of one effect on each fit run, (rows, p)."""
        key = (effect.name, templates.only(fields_of(effect)))
        if key not in self._rows:
            if len(self._rows) > KEPT_ROWS:
                self._rows = {k: v for k, v in self._rows.items() if not k[1].values}
            rows, blocks = [], []
            for number, data in enumerate(self.campaign.fit):
                columns = effect.design(self._source.of(data, key[1]))
                rows.append(self._whiten(number, columns))
                blocks.append(means(columns, self._blocks[number]))
            self._rows[key] = tuple(rows)
            self._means[key] = np.concatenate(blocks)
        return self._rows[key]

    def block_means(self, effect: Effect, templates: Templates) -> FloatArray:
        """Block means of one effect's columns, shape (b, 3, p)."""
        key = (effect.name, templates.only(fields_of(effect)))
        if key not in self._means:
            self.rows(effect, templates)
        return self._means[key]

    def grams(self, templates: Templates, names: frozenset[str] | None = None) -> tuple[Gram, ...]:
        """One Gram per fit run (zero for runs without motion); right for the columns of `names` (all where None)."""
        wanted = [e for e in self.effects if names is None or e.name in names]
        own = {e.name: templates.only(fields_of(e)) for e in wanted}
        changed = [e for e in wanted if own[e.name].values or (names is not None and e.wide_band)]
        key = frozenset((e.name, own[e.name]) for e in changed)
        if not changed:
            return self._base
        if key not in self._grams:
            if len(self._grams) > KEPT_GRAMS:
                self._grams.clear()
            wide = [e for e in changed if e.wide_band]
            self._grams[key] = self._widened(self._replaced(changed, own), wide, templates)
        return self._grams[key]

    def _widened(self, grams: tuple[Gram, ...], wide: Sequence[Effect], templates: Templates) -> tuple[Gram, ...]:
        """With the rows above the common band, which only some effects have."""
        if not wide:
            return grams
        index = self.columns.index(frozenset(e.name for e in wide))
        out = []
        for gram, (xx, xy) in zip(grams, self._wide.products(wide, templates), strict=True):
            sums = gram.xx.copy(), gram.xy.copy()
            sums[0][np.ix_(index, index)] += xx
            sums[1][index] += xy
            out.append(Gram(*sums, gram.yy, gram.rows))
        return tuple(out)

    def _replaced(self, changed: Sequence[Effect], own: Mapping[str, Templates]) -> tuple[Gram, ...]:
        """The default Grams with the columns of some effects at other template values."""
        P = self.columns.total
        index = {e.name: self.columns.index(frozenset({e.name})) for e in changed}
        out = []
        for number, base in enumerate(self._base):
            if not base.rows:
                out.append(base)
                continue
            xx, xy = base.xx.copy(), base.xy.copy()
            for e in changed:
                cross = self._crossed(e, own[e.name])[number]
                i = index[e.name]
                xx[i, :], xx[:, i] = cross[:, :P], cross[:, :P].T
                xy[i] = cross[:, P]
            for e in changed:
                for f in changed:
                    a, b = (self.rows(x, own[x.name])[number] for x in (e, f))
                    xx[np.ix_(index[e.name], index[f.name])] = a.T @ b
            out.append(Gram(xx, xy, base.yy, base.rows))
        return tuple(out)

    def _crossed(self, effect: Effect, templates: Templates) -> tuple[FloatArray, ...]:
        """Products of an effect's rows with all default columns and the measured rate, by run, (p, P + 1)."""
        key = (effect.name, templates)
        if key not in self._cross:
            self._cross[key] = tuple(
                rows.T @ stack for rows, stack in zip(self.rows(effect, templates), self._stack, strict=True)
            )
        return self._cross[key]

    def _whiten(self, number: int, series: FloatArray) -> FloatArray:
        """Whitened rows of a run's columns (n, 3, k), all moving windows and axes one after the other."""
        parts = [np.zeros((0, series.shape[2]))]
        for window, bins in self._windows[number]:
            both = series[window.start : window.stop]
            for axis in self._noise:
                used = np.flatnonzero(both[:, axis, :].any(axis=0))  # most leave most columns of an axis empty
                rows = np.zeros((2 * len(bins.frequency), series.shape[2]))
                if len(used):
                    rows[:, used] = axis_rows(np.ascontiguousarray(both[:, axis, used].T), bins, axis)
                parts.append(rows)
        return np.concatenate(parts)


def _gram(rows: FloatArray) -> Gram:
    X, y = rows[:, :-1], rows[:, -1]
    return Gram(X.T @ X, X.T @ y, float(y @ y), len(y))
