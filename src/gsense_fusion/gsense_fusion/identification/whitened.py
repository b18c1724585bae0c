"""Fast part of the likelihood: whitened regressors of each moving window, reduced to small Gram matrices per run.

In the frequency domain stationary noise is independent from bin to bin, so generalised least squares is a division by
the square root of the spectrum. Constant, slope and curvature of each window are projected out: slow things are the
business of `slow`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.fft import rfft

from gsense_fusion.identification.campaign import Campaign, DriverSource, RunData, Window, slice_drivers
from gsense_fusion.identification.effects.base import Drivers, Effect, Templates
from gsense_fusion.identification.noise import NoiseModel
from gsense_fusion.identification.types import BoolArray, FloatArray, IntArray

LOWEST_HZ = 0.04
HIGHEST_HZ = 25.0
USED_BAND = 0.4
"""Bins up to this part of the sample rate are used."""


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


def design(effects: tuple[Effect, ...], source: DriverSource, data: RunData, templates: Templates) -> FloatArray:
    """All effects' columns on a run's whole grid, shape (n, 3, P)."""
    return stack(effects, source.of(data, templates))


def stack(effects: tuple[Effect, ...], drivers: Drivers) -> FloatArray:
    """All effects' columns, shape (n, 3, P); P is zero where nothing can be decided."""
    return np.concatenate([np.zeros((len(drivers), 3, 0)), *(effect.design(drivers) for effect in effects)], axis=2)


@dataclass(frozen=True)
class Bins:
    """The frequencies of a window that are used and the whitening of each axis."""

    keep: BoolArray
    frequency: FloatArray
    weight: FloatArray
    """Multiplies the rfft so that real and imaginary parts have unit variance, shape (bins, 3)."""


def window_bins(n: int, rate_hz: float, noise: Mapping[int, NoiseModel], highest_hz: float = HIGHEST_HZ) -> Bins:
    """Bins of a window of n samples."""
    frequency = np.fft.rfftfreq(n, 1 / rate_hz)
    resolution = rate_hz / n
    keep = (frequency >= max(LOWEST_HZ, 0.5 * resolution)) & (frequency <= min(highest_hz, USED_BAND * rate_hz))
    weight = np.zeros((int(keep.sum()), 3))
    for axis, model in noise.items():
        f = frequency[keep]
        weight[:, axis] = np.sqrt(4.0 / (rate_hz * n * model.psd(f))) * model.usable(f, resolution)
    return Bins(keep, frequency[keep], weight)


def whiten(series: FloatArray, bins: Bins) -> FloatArray:
    """Rows of unit variance from series of shape (n, 3, k): shape (2 * bins, 3, k), real parts first."""
    spectrum = np.fft.rfft(series, axis=0)[bins.keep] * bins.weight[:, :, None]
    return np.concatenate([spectrum.real, spectrum.imag], axis=0)


def project_out_slow(rows: FloatArray, n: int, bins: Bins) -> FloatArray:
    """Remove a constant, a slope and a curvature per axis from whitened rows (2 * bins, 3, k)."""
    t = np.linspace(-1.0, 1.0, n)
    basis = np.stack([t, t**2], axis=1)
    out = np.empty_like(rows)
    for axis in range(3):
        white = whiten(np.repeat(basis[:, None, :], 3, axis=1), bins)[:, axis, :]
        q, _ = np.linalg.qr(white)
        out[:, axis, :] = rows[:, axis, :] - q @ (q.T @ rows[:, axis, :])
    return out


class WhitenedCampaign:
    """Gram matrices of the moving windows of the fit runs, for any template values."""

    def __init__(
        self, campaign: Campaign, source: DriverSource, effects: tuple[Effect, ...], noise: Mapping[int, NoiseModel]
    ) -> None:
        """Take what the columns are made of."""
        self.campaign = campaign
        self.effects = effects
        self.columns = Columns.of(effects)
        self._source = source
        self._noise = noise
        self._cache: dict[Templates, tuple[Gram, ...]] = {}

    def grams(self, templates: Templates) -> tuple[Gram, ...]:
        """One Gram per fit run (zero for runs without motion)."""
        if templates not in self._cache:
            if len(self._cache) > 64:
                self._cache.clear()
            self._cache[templates] = tuple(self._run_gram(r, templates) for r in self.campaign.fit)
        return self._cache[templates]

    def _run_gram(self, data: RunData, templates: Templates) -> Gram:
        total = Gram.zero(self.columns.total)
        for window in data.windows:
            if window.moving:
                rows = self.rows(data, window, templates)
                X, y = rows[:, :-1], rows[:, -1]
                total = total + Gram(X.T @ X, X.T @ y, float(y @ y), len(y))
        return total

    def rows(self, data: RunData, window: Window, templates: Templates) -> FloatArray:
        """Whitened columns with the measured rate as the last one, shape (rows, P + 1)."""
        drivers = slice_drivers(self._source.of(data, templates), window)
        X = stack(self.effects, drivers)
        y = data.run.angular_rate[window.start : window.stop, :, None]
        both = np.concatenate([X, y], axis=2)
        bins = window_bins(len(window), data.run.rate_hz, self._noise)
        parts = []
        for axis in self._noise:
            used = np.flatnonzero(both[:, axis, :].any(axis=0))  # most effects leave most columns of an axis empty
            rows = np.zeros((2 * len(bins.frequency), both.shape[2]))
            rows[:, used] = _axis_rows(np.ascontiguousarray(both[:, axis, used].T), bins, axis)
            parts.append(rows)
        return np.concatenate(parts)


def _axis_rows(series: FloatArray, bins: Bins, axis: int) -> FloatArray:
    """Whitened rows (2 * bins, k) of k series (k, n) of one axis, slow parts projected out."""
    n = series.shape[1]
    t = np.linspace(-1.0, 1.0, n)
    spectrum = rfft(np.concatenate([series, t[None], t[None] ** 2]), axis=1)[:, bins.keep] * bins.weight[:, axis]
    rows = np.concatenate([spectrum.real, spectrum.imag], axis=1).T
    q, _ = np.linalg.qr(rows[:, -2:])
    return np.asarray(rows[:, :-2] - q @ (q.T @ rows[:, :-2]))
