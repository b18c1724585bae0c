"""Fast part of the likelihood: whitened regressors of each moving window, reduced to small Gram matrices per run.

In the frequency domain stationary noise is independent from bin to bin, so generalised least squares is a division by
the square root of the spectrum. Constant, slope and curvature of each window are projected out: slow things are the
business of `slow`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from scipy.fft import rfft

from gsense_fusion.identification.campaign import Campaign, Window
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.effects.design import Mixed
from gsense_fusion.identification.kept import kept
from gsense_fusion.identification.likelihood.bins import HIGHEST_HZ, Bins, axis_rows, rows_by_axis, window_bins
from gsense_fusion.identification.likelihood.gram import Columns, Gram
from gsense_fusion.identification.likelihood.store import Designs, fields_of, means
from gsense_fusion.identification.likelihood.wideband import WideBand
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import FloatArray

KEPT_ROWS = 160
KEPT_GRAMS = 64
KEPT_PRODUCTS = 10_000
"""Each has some kilobytes, where the rows that it is made of have a megabyte."""

Changed = tuple[Effect, Templates]
"""An effect whose columns are not the default ones, and the searched values that they depend on."""


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
    series of one effect: their products with all others by axis, spread over the parameters afterwards.
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
        self._designs = Designs(source, len(campaign.fit))
        self._noise = noise
        self._blocks = [[w for r, w in cuts if r == number] for number in range(len(campaign.fit))]
        self._windows = [
            [(w, window_bins(len(w), r.run.rate_hz, noise)) for w in r.windows if w.moving] for r in campaign.fit
        ]
        self._wide = WideBand(campaign, self._designs, noise, HIGHEST_HZ)
        self._default_rows = kept(None, self._made_rows)
        self._moved_rows = kept(KEPT_ROWS, self._made_rows)
        self._means: dict[tuple[str, Templates], FloatArray] = {}
        self._crossed = kept(None, self._crossed_with)
        self._product = kept(KEPT_PRODUCTS, self._product_of)
        self._grams = kept(KEPT_GRAMS, self._grams_of)
        measured = [self._measured(i, r.run.angular_rate) for i, r in enumerate(campaign.fit)]
        # terms that have to be bought are made when the search asks for them
        default = [self._none(e, measured) if e.bought else self.rows(e, Templates()) for e in effects]
        self._stack = [np.concatenate([*(d.rows[i] for d in default), y], axis=2) for i, y in enumerate(measured)]
        self._spread = _spread_beside([d.spread for d in default], len(campaign.fit), [*noise])
        self._base = self._summed(self._default_grams(measured))
        self._sums = np.array([g.xx for g in self._base.runs]), np.array([g.xy for g in self._base.runs])

    def rows(self, effect: Effect, templates: Templates) -> _Rows:
        """Whitened series of one effect on each fit run."""
        own = templates.only(fields_of(effect))
        return self._moved_rows(effect, own) if own.values else self._default_rows(effect, own)

    def _made_rows(self, effect: Effect, templates: Templates) -> _Rows:
        rows, blocks, spread = [], [], []
        for number, data in enumerate(self.campaign.fit):
            design = self._designs.of(effect, data, templates)
            rows.append(self._whiten(number, design.series))
            blocks.append(_means(design, self._blocks[number]))
            spread.append(design.spread[:, [*self._noise]].transpose(1, 0, 2))
        self._means[effect.name, templates] = np.concatenate(blocks)
        return _Rows(tuple(rows), np.array(spread))

    def block_means(self, effect: Effect, templates: Templates) -> FloatArray:
        """Block means of one effect's columns, shape (b, 3, p)."""
        key = (effect.name, templates.only(fields_of(effect)))
        if key not in self._means:
            designs = (self._designs.of(effect, r, key[1]) for r in self.campaign.fit)
            self._means[key] = np.concatenate([_means(d, b) for d, b in zip(designs, self._blocks, strict=True)])
        return self._means[key]

    def _none(self, effect: Effect, measured: Sequence[FloatArray]) -> _Rows:
        """No series, and so columns of zeros."""
        spread = np.zeros((len(measured), len(self._noise), 0, len(effect.parameters)))
        return _Rows(tuple(y[:, :, :0] for y in measured), spread)

    def grams(self, templates: Templates, names: frozenset[str] | None = None) -> tuple[Gram, ...]:
        """One Gram per fit run (zero for runs without motion); right for the columns of `names` (all where None)."""
        return self._found(templates, names).runs

    def mounting_grams(self, templates: Templates, names: frozenset[str] | None = None) -> Mapping[int, Gram]:
        """The same in sum by mounting (-1 where it is unknown), for those in which a run moves."""
        return self._found(templates, names).mountings

    def _found(self, templates: Templates, names: frozenset[str] | None) -> _Grams:
        wanted = [e for e in self.effects if e.parameters and (names is None or e.name in names)]
        own = [(e, templates.only(fields_of(e))) for e in wanted]
        changed = tuple((e, t) for e, t in own if t.values or (names is not None and (e.wide_band or e.bought)))
        return self._grams(changed) if changed else self._base

    def _grams_of(self, changed: tuple[Changed, ...]) -> _Grams:
        return self._summed(self._widened(self._replaced(changed), tuple(c for c in changed if c[0].wide_band)))

    def _summed(self, runs: tuple[Gram, ...]) -> _Grams:
        out: dict[int, Gram] = {}
        for data, gram in zip(self.campaign.fit, runs, strict=True):
            key = -1 if data.mounting_number is None else data.mounting_number
            if gram.rows:
                out[key] = out[key] + gram if key in out else gram
        return _Grams(runs, out)

    def _widened(self, grams: tuple[Gram, ...], wide: tuple[Changed, ...]) -> tuple[Gram, ...]:
        """With the rows above the common band, which only some effects have."""
        if not wide:
            return grams
        index = self.columns.index(frozenset(e.name for e, _ in wide))
        out = []
        for gram, (xx, xy) in zip(grams, self._wide.products(wide), strict=True):
            sums = gram.xx.copy(), gram.xy.copy()
            sums[0][np.ix_(index, index)] += xx
            sums[1][index] += xy
            out.append(Gram(*sums, gram.yy, gram.rows))
        return tuple(out)

    def _default_grams(self, measured: Sequence[FloatArray]) -> tuple[Gram, ...]:
        """Grams of all effects at their default templates."""
        out = []
        for stack, spread, y in zip(self._stack, self._spread, measured, strict=True):
            full = _spread_out(stack.transpose(0, 2, 1) @ stack, spread, spread)
            size = y.shape[0] * y.shape[1]
            out.append(Gram(full[:-1, :-1], full[:-1, -1], float(full[-1, -1]), size))
        return tuple(out)

    def _replaced(self, changed: tuple[Changed, ...]) -> tuple[Gram, ...]:
        """The default Grams with the columns of some effects at other template values."""
        P = self.columns.total
        index = {e: self.columns.index(frozenset({e.name})) for e, _ in changed}
        xx, xy = self._sums[0].copy(), self._sums[1].copy()
        for e, templates in changed:
            cross, i = self._crossed(e, templates), index[e]
            xx[:, i, :], xx[:, :, i] = cross[:, :, :P], cross[:, :, :P].transpose(0, 2, 1)
            xy[:, i] = cross[:, :, P]
        for one, other in combinations_with_replacement(changed, 2):
            product, i, j = self._product(one, other), index[one[0]], index[other[0]]
            xx[:, i[:, None], j], xx[:, j[:, None], i] = product, product.transpose(0, 2, 1)
        each = zip(xx, xy, self._base.runs, strict=True)
        return tuple(Gram(a, b, base.yy, base.rows) if base.rows else base for a, b, base in each)

    def _product_of(self, one: Changed, other: Changed) -> FloatArray:
        """Products of two effects' columns by run, shape (runs, p, q)."""
        a, b = self.rows(*one), self.rows(*other)
        inner = np.array([x.transpose(0, 2, 1) @ y for x, y in zip(a.rows, b.rows, strict=True)])
        return _spread_out(inner, a.spread, b.spread)

    def _crossed_with(self, effect: Effect, templates: Templates) -> FloatArray:
        """Products of an effect's columns with all default columns and the measured rate, shape (runs, p, P + 1)."""
        own = self.rows(effect, templates)
        inner = np.array([x.transpose(0, 2, 1) @ y for x, y in zip(own.rows, self._stack, strict=True)])
        return _spread_out(inner, own.spread, self._spread)

    def _whiten(self, number: int, series: FloatArray) -> FloatArray:
        """Whitened rows (axes, rows, k) of a run's series (k, n), all moving windows one after the other."""
        parts: list[FloatArray] = [np.zeros((len(self._noise), 0, len(series)))]
        parts += [rows_by_axis(series[:, w.start : w.stop], bins, self._noise) for w, bins in self._windows[number]]
        return np.concatenate(parts, axis=1)

    def _measured(self, number: int, rate: FloatArray) -> FloatArray:
        """Whitened rows (axes, rows, 1) of a run's angular rate (n, 3), each axis by itself."""
        parts = [
            np.stack([axis_rows(np.ascontiguousarray(rate[w.start : w.stop, a][None]), bins, a) for a in self._noise])
            for w, bins in self._windows[number]
        ]
        return np.concatenate([np.zeros((len(self._noise), 0, 1)), *parts], axis=1)


@dataclass(frozen=True, eq=False)
class _Grams:
    """Products of all columns at some template values."""

    runs: tuple[Gram, ...]
    mountings: Mapping[int, Gram]


@dataclass(frozen=True, eq=False)
class _Rows:
    """One effect on the fit runs."""

    rows: tuple[FloatArray, ...]
    """Whitened series of each run, shape (axes, rows, k)."""
    spread: FloatArray
    """Shape (runs, axes, k, p)."""


def _means(design: Mixed, blocks: Sequence[Window]) -> FloatArray:
    """Block means of an effect's columns on a run, shape (b, 3, p)."""
    k, _, p = design.spread.shape
    return np.asarray((means(design.series, blocks) @ design.spread.reshape(k, 3 * p)).reshape(len(blocks), 3, p))


def _spread_beside(parts: Sequence[FloatArray], runs: int, axes: Sequence[int]) -> FloatArray:
    """Spread of all effects' series beside each other, the measured rate last, shape (runs, axes, K + 1, P + 1)."""
    k, p = sum(s.shape[2] for s in parts), sum(s.shape[3] for s in parts)
    out = np.zeros((runs, len(axes), k + 1, p + 1))
    i = j = 0
    for s in parts:
        out[:, :, i : i + s.shape[2], j : j + s.shape[3]] = s
        i, j = i + s.shape[2], j + s.shape[3]
    out[:, :, k, p] = 1.0
    return out


def _spread_out(inner: FloatArray, left: FloatArray, right: FloatArray) -> FloatArray:
    """Products by axis of series (..., axes, k, l) as products of columns, (..., p, q)."""
    return np.asarray((left.swapaxes(-1, -2) @ inner @ right).sum(axis=-3))
