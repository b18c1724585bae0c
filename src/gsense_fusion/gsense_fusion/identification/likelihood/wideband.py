"""Rows above the band of the other effects: for teeth, at v / pitch, and for the turns after a reversal.

The drive's own harmonics end far below, so every other column is zero here, and the model without such an effect has
nothing to say: its likelihood stays what it was. What the gyro makes of vibration (kicks of friction at the reversals
through G) is no column either: whatever goes with the measured specific force and its rate of change is taken out.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np
from scipy.fft import rfft

from gsense_fusion.identification.campaign import Campaign, Window
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.effects.design import Mixed
from gsense_fusion.identification.kept import kept
from gsense_fusion.identification.likelihood.bins import Bins, axis_rows, rows_by_axis, whitened, window_bins
from gsense_fusion.identification.likelihood.store import DELAY, Designs
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import ComplexArray, FloatArray

WIDEST_HZ = 80.0
PASSED = 0.5
"""Amplitude that the sensor's filter must leave: beyond it phase and size are the filter's more than the rig's."""
DELAY_STEP_S = 1e-3
"""The gyro's delay counts here in such steps: what the filter's phase is off by would pass for a fraction of a
millisecond at these frequencies."""
KEPT = 32
KEPT_PRODUCTS = 1000
DELAYS_S = tuple(0.003 * k for k in range(16))
"""By which the gyro may be later than the accelerometer; between them the rate of change stands for the rest."""

Rows = list[list[FloatArray]]
"""By run and window: whitened rows of each gyro axis, (axes, rows, columns)."""


class WideBand:
    """Products of some effects' whitened columns with each other and with the measured rate, by fit run."""

    def __init__(self, campaign: Campaign, designs: Designs, noise: Mapping[int, NoiseModel], above_hz: float) -> None:
        """Take the runs; nothing is computed before an effect with a wide band is asked for."""
        self._campaign = campaign
        self._designs = designs
        self._noise = noise
        self._response = Response.of(noise, campaign.rate_hz)
        self._above = above_hz
        self._windows: list[list[tuple[Window, Bins]]] | None = None
        self._vibration: Rows = []
        self._measured: list[FloatArray] = []
        self._rows = kept(KEPT, self._rows_of)
        self._products = kept(KEPT_PRODUCTS, self._products_of)

    def products(self, effects: Sequence[tuple[Effect, Templates]]) -> list[tuple[FloatArray, FloatArray]]:
        """X'X (p, p) and X'y (p,) for each fit run, of effects' columns in their order at the effects' own values."""
        return self._products(tuple((e, _in_steps(t)) for e, t in effects))

    def _products_of(self, effects: tuple[tuple[Effect, Templates], ...]) -> list[tuple[FloatArray, FloatArray]]:
        self._prepare()
        columns = [self._rows(*own) for own in effects]
        X = [np.concatenate(parts, axis=1) for parts in zip(*columns, strict=True)]
        return [(x.T @ x, x.T @ y) for x, y in zip(X, self._measured, strict=True)]

    def _prepare(self) -> None:
        if self._windows is not None:
            return
        self._windows = [
            [(w, self._bins(len(w), r.run.rate_hz)) for w in r.windows if w.moving] for r in self._campaign.fit
        ]
        for number, data in enumerate(self._campaign.fit):
            self._windows[number] = [(w, self._levelled(data.run.angular_rate, w, b)) for w, b in self._windows[number]]
        runs = range(len(self._windows))
        measured = [self._whiten(number) for number in runs]
        spectra = [self._felt(number) for number in runs]
        left = np.inf
        for delay in DELAYS_S:
            vibration = [[_later(x, b, delay, self._noise) for x, b in run] for run in spectra]
            flat = [x[:, 0] for x in _flat(vibration, measured, 1)]
            energy = float(sum(x @ x for x in flat))
            if energy < left:
                left, self._vibration, self._measured = energy, vibration, flat

    def _bins(self, n: int, rate_hz: float) -> Bins:
        bins = window_bins(n, rate_hz, self._noise, WIDEST_HZ)
        wide = (bins.frequency > self._above) & (self._response.at(bins.frequency) >= PASSED)
        keep = bins.keep.copy()
        keep[np.flatnonzero(bins.keep)[~wide]] = False
        return Bins(keep, bins.frequency[wide], bins.weight[wide], n, bins.noise)

    def _levelled(self, rate: FloatArray, window: Window, bins: Bins) -> Bins:
        """Weights by the noise that is there in motion: a belt that rings is more than there is at rest."""
        weight = bins.weight.copy()
        for axis in self._noise:
            series = np.ascontiguousarray(rate[window.start : window.stop, axis][None])
            rows = axis_rows(series, bins, axis)[:, 0]
            if len(rows):
                power = (rows[: len(rows) // 2] ** 2 + rows[len(rows) // 2 :] ** 2) / 2.0
                weight[:, axis] /= np.sqrt(max(1.0, float(np.median(power)) / np.log(2.0)))
        return Bins(bins.keep, bins.frequency, weight, bins.samples, bins.noise)

    def _rows_of(self, effect: Effect, templates: Templates) -> tuple[FloatArray, ...]:
        """Rows by run, (rows, p)."""
        designs = (self._designs.of(effect, r, templates) for r in self._campaign.fit)
        columns = [self._columns(i, d) for i, d in enumerate(designs)]
        return tuple(_flat(self._vibration, columns, len(effect.parameters)))

    def _columns(self, number: int, design: Mixed) -> list[FloatArray]:
        """Whitened columns of a run's design, (axes, rows, p) of each window."""
        spread = design.spread[:, [*self._noise]].transpose(1, 0, 2)
        return [
            rows_by_axis(design.series[:, w.start : w.stop], bins, self._noise) @ spread
            for w, bins in (self._windows or [])[number]
        ]

    def _whiten(self, number: int) -> list[FloatArray]:
        """Whitened rows of a run's angular rate, (axes, rows, 1) of each window."""
        rate = self._campaign.fit[number].run.angular_rate
        return [
            np.stack([axis_rows(np.ascontiguousarray(rate[None, w.start : w.stop, a]), b, a) for a in self._noise])
            for w, b in (self._windows or [])[number]
        ]

    def _felt(self, number: int) -> list[tuple[ComplexArray, Bins]]:
        """Spectra of a run's specific force and its change by sample, (bins, 6) of each window."""
        force = self._campaign.fit[number].run.specific_force
        force = np.where(np.isfinite(force), force, 0.0)
        out = []
        for window, bins in (self._windows or [])[number]:
            cut = force[window.start : window.stop]
            series = np.concatenate([cut, np.gradient(cut, axis=0)], axis=1)
            out.append((rfft(series, axis=0)[bins.keep], bins))
        return out


def _in_steps(templates: Templates) -> Templates:
    """The same with the gyro's delay in whole steps."""
    if not templates.gyro_delay_s:
        return templates
    return templates.set(DELAY, round(templates.gyro_delay_s / DELAY_STEP_S) * DELAY_STEP_S)


def _later(spectrum: ComplexArray, bins: Bins, delay_s: float, axes: Collection[int]) -> FloatArray:
    """Whitened rows (axes, rows, k) of what has the spectrum (bins, k), later by a delay and periodic."""
    turned = spectrum * np.exp(-2j * np.pi * delay_s * bins.frequency)[:, None]
    return whitened(np.concatenate([turned.real, turned.imag]), bins, axes)


def _flat(vibration: Rows, rows: Rows, width: int) -> list[FloatArray]:
    """Rows (rows, width) by run, in a row, without what goes with the vibration (one factor for all runs)."""
    pairs = [(f, x) for felt, own in zip(vibration, rows, strict=True) for f, x in zip(felt, own, strict=True)]
    if not pairs:
        return [np.zeros((0, width)) for _ in rows]
    normal = sum(f.transpose(0, 2, 1) @ f for f, _ in pairs)
    moved = sum(f.transpose(0, 2, 1) @ x for f, x in pairs)
    factor = np.linalg.pinv(normal, rcond=1e-9, hermitian=True) @ moved
    out = []
    for felt, own in zip(vibration, rows, strict=True):
        parts = [(x - f @ factor).reshape(-1, width) for f, x in zip(felt, own, strict=True)]
        out.append(np.concatenate([np.zeros((0, width)), *parts]))
    return out
