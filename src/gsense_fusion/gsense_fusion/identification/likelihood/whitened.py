"""Fast part of the likelihood: whitened regressors of each moving window, reduced to small Gram matrices per run.

In the frequency domain stationary noise is independent from bin to bin, so generalised least squares is a division by
the square root of the spectrum. Constant, slope and curvature of each window are projected out: slow things are the
business of `slow`.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

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

Placed = tuple[Effect, Templates]
"""An effect and the searched values that its columns depend on."""


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
        self._product = kept(KEPT_PRODUCTS, self._product_of)
        self._sums = kept(KEPT_GRAMS, self._sums_of)
        measured = tuple(self._whitened_rate(i, r.run.angular_rate) for i, r in enumerate(campaign.fit))
        self._measured = _Rows(measured, np.ones((len(campaign.fit), len(noise), 1, 1)))
        self._energy = [float(np.vdot(y, y)) for y in measured]
        self._count = [y.shape[0] * y.shape[1] for y in measured]
        self._mountings: dict[int, list[int]] = {}
        """Places of the runs that move, by mounting."""
        for place, data in enumerate(campaign.fit):
            number = -1 if data.mounting_number is None else data.mounting_number
            if self._count[place]:
                self._mountings.setdefault(number, []).append(place)

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

    def grams(self, templates: Templates, names: frozenset[str]) -> tuple[Gram, ...]:
        """One Gram per fit run (zero for runs without motion); zero beside the columns of `names`."""
        xx, xy = self._found(templates, names)
        index, P = self.columns.index(names), self.columns.total
        out = []
        for a, b, yy, count in zip(xx, xy, self._energy, self._count, strict=True):
            full = np.zeros((P, P)), np.zeros(P)
            full[0][index[:, None], index], full[1][index] = a, b
            out.append(Gram(*full, yy, count))
        return tuple(out)

    def mounting_grams(self, templates: Templates, names: frozenset[str]) -> dict[int, Gram]:
        """In sum by mounting (-1 where it is unknown), for those in which a run moves; columns of `names` alone."""
        xx, xy = self._found(templates, names)
        return {
            mounting: Gram(
                xx[runs].sum(axis=0),
                xy[runs].sum(axis=0),
                sum(self._energy[i] for i in runs),
                sum(self._count[i] for i in runs),
            )
            for mounting, runs in self._mountings.items()
        }

    def _found(self, templates: Templates, names: frozenset[str]) -> tuple[FloatArray, FloatArray]:
        """X'X (runs, k, k) and X'y (runs, k) of the columns of some effects."""
        wanted = (e for e in self.effects if e.parameters and e.name in names)
        return self._sums(tuple((e, templates.only(fields_of(e))) for e in wanted))

    def _sums_of(self, effects: tuple[Placed, ...]) -> tuple[FloatArray, FloatArray]:
        ends = np.cumsum([0, *(len(e.parameters) for e, _ in effects)]).tolist()
        place = {e: slice(*ab) for (e, _), ab in zip(effects, itertools.pairwise(ends), strict=True)}
        xx = np.zeros((len(self._count), ends[-1], ends[-1]))
        xy = np.zeros((len(self._count), ends[-1]))
        for e, templates in effects:
            xy[:, place[e]] = self._product((e, templates), None)[:, :, 0]
        for one, other in itertools.combinations_with_replacement(effects, 2):
            product, i, j = self._product(one, other), place[one[0]], place[other[0]]
            xx[:, i, j], xx[:, j, i] = product, product.transpose(0, 2, 1)
        self._widen(xx, xy, [(e, t, place[e]) for e, t in effects if e.wide_band])
        return xx, xy

    def _widen(self, xx: FloatArray, xy: FloatArray, wide: Sequence[tuple[Effect, Templates, slice]]) -> None:
        """Add the rows above the common band, which only some effects have."""
        if not wide:
            return
        index = np.concatenate([np.arange(place.start, place.stop) for _, _, place in wide])
        for a, b, (more_xx, more_xy) in zip(xx, xy, self._wide.products([(e, t) for e, t, _ in wide]), strict=True):
            a[np.ix_(index, index)] += more_xx
            b[index] += more_xy

    def _product_of(self, one: Placed, other: Placed | None) -> FloatArray:
        """Products of two effects' columns by run, or of one's with the measured rate, shape (runs, p, q)."""
        a = self.rows(*one)
        b = self._measured if other is None else self.rows(*other)
        inner = np.array([x.transpose(0, 2, 1) @ y for x, y in zip(a.rows, b.rows, strict=True)])
        return np.asarray((a.spread.swapaxes(-1, -2) @ inner @ b.spread).sum(axis=-3))

    def _whiten(self, number: int, series: FloatArray) -> FloatArray:
        """Whitened rows (axes, rows, k) of a run's series (k, n), all moving windows one after the other."""
        parts = [rows_by_axis(series[:, w.start : w.stop], bins, self._noise) for w, bins in self._windows[number]]
        if len(parts) == 1:
            return parts[0]
        return np.concatenate([np.zeros((len(self._noise), 0, len(series))), *parts], axis=1)

    def _whitened_rate(self, number: int, rate: FloatArray) -> FloatArray:
        """Whitened rows (axes, rows, 1) of a run's angular rate (n, 3), each axis by itself."""
        parts = [
            np.stack([axis_rows(np.ascontiguousarray(rate[w.start : w.stop, a][None]), bins, a) for a in self._noise])
            for w, bins in self._windows[number]
        ]
        return np.concatenate([np.zeros((len(self._noise), 0, 1)), *parts], axis=1)


@dataclass(frozen=True, eq=False)
class _Rows:
    """One effect, or the measured rate, on the fit runs."""

    rows: tuple[FloatArray, ...]
    """Whitened series of each run, shape (axes, rows, k)."""
    spread: FloatArray
    """Shape (runs, axes, k, p)."""


def _means(design: Mixed, blocks: Sequence[Window]) -> FloatArray:
    """Block means of an effect's columns on a run, shape (b, 3, p)."""
    k, _, p = design.spread.shape
    return np.asarray((means(design.series, blocks) @ design.spread.reshape(k, 3 * p)).reshape(len(blocks), 3, p))
