"""The whitened residual of a fitted model, window by window: what the sufficiency tests look at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gsense_fusion.identification.campaign import RunData, Window
from gsense_fusion.identification.likelihood.bins import HIGHEST_HZ, USED_BAND, Bins, rows_by_axis, window_bins
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.likelihood.store import DELAY, predicted
from gsense_fusion.identification.likelihood.whitened import project_out_slow, whiten
from gsense_fusion.identification.motion.phasors import turning
from gsense_fusion.identification.types import BoolArray, ComplexArray, FloatArray, IntArray
from gsense_fusion.identification.verdict.coherent import Extra, without_coherent
from gsense_fusion.identification.verdict.steady_orders import without_high_orders

HALF_ORDERS = np.arange(0.5, 10.01, 0.5)
MODEL_ABOVE_HZ = 20.0
ORDER_BINS = 2.5
"""Bins to either side that an order may reach."""
NARROW = 0.25
"""Of an order: what whole orders may reach to be told from what is between them."""
WIDEST_FOLDED = 0.125
"""Of an order: what folded orders may reach, so that half of the bins are left; the kicks of a slow drive are weak."""
FOLDED_FROM = 0.25
"""Of the sample rate: images of what is higher than three quarters of it, the sensor's filter has taken."""
SINGULAR = 1e-10
"""Of a determinant: less is rounding."""
SIDE_BINS = 8
"""On either side a sine is looked for. Behind a narrow filter the bins far above weigh most: what a slope's edges leave
there, and with it the drift in the lowest bins, would speak at every order."""
LEVEL_BINS = 60
"""Bins that say how high the noise is beside a line."""


@dataclass(frozen=True, eq=False)
class WindowResidual:
    """One window's residual as whitened Fourier coefficients."""

    data: RunData
    window: Window
    bins: Bins
    spectrum: FloatArray
    """Real and imaginary parts of unit variance where the model is complete, shape (2, m, 3); zero for absent axes."""
    folded: FloatArray | None = None
    """What may fold of the answers to the force's rate of change, as `power`, shape (m, 3); None where nothing."""

    @property
    def frequency(self) -> FloatArray:
        """Hz, shape (m,)."""
        return self.bins.frequency

    @cached_property
    def power(self) -> FloatArray:
        """Squared modulus over its expectation, shape (m, 3): exponential with mean one."""
        return np.asarray(np.sum(self.spectrum**2, axis=0) / 2.0)

    @property
    def unfolded(self) -> FloatArray:
        """The power without what may be folded at most, shape (m, 3)."""
        return self.power if self.folded is None else np.asarray(self.power - self.folded)

    @property
    def resolution_hz(self) -> float:
        """Distance of the bins."""
        return self.data.run.rate_hz / len(self.window)

    @property
    def angular_frequency(self) -> float | None:
        """Of the drive in rad/s."""
        if not self.window.moving or self.data.motion is None:
            return None
        return self.data.motion.angular_frequency

    def away_from_orders(self) -> BoolArray:
        """Bins that no order of the drive can reach (half-orders to 10, whole ones beyond, folded ones), shape (m,)."""
        return self._away

    def between_orders(self, series: FloatArray) -> FloatArray:
        """The window's part of some series (n, c) without the high orders that `away_from_orders` leaves out."""
        w = self.angular_frequency
        width = 1.0 if w is None else self._order_width(w)
        if w is None or width >= NARROW:
            return series
        return without_high_orders(series, w, self.data.run.rate_hz, self._reached(width))

    def gone_with_an_order(self, frequency_hz: float) -> bool:
        """Whether `between_orders` has taken out what is at a frequency, with a high order that folds down to there."""
        w = self.angular_frequency
        width = 1.0 if w is None else self._order_width(w)
        folds = self.data.run.rate_hz - frequency_hz
        if w is None or width >= WIDEST_FOLDED or folds > self._reached(width) * self.data.run.rate_hz:
            return False
        order = folds * 2 * np.pi / w
        return bool(abs(order - np.rint(order)) < width)

    def _reached(self, width: float) -> float:
        """Part of the sample rate up to which the orders are taken out that may reach so far to either side."""
        if width >= WIDEST_FOLDED:
            return USED_BAND
        # what folds into the band of the fit lies among the drive's low orders
        return max(1.0 - FOLDED_FROM, 1.0 - HIGHEST_HZ / self.data.run.rate_hz)

    def _order_width(self, w: float) -> float:
        """What an order may reach to either side, in orders of the drive in rad/s."""
        return ORDER_BINS * self.resolution_hz * 2 * np.pi / w

    @cached_property
    def _away(self) -> BoolArray:
        w = self.angular_frequency
        if w is None:
            return np.ones(len(self.frequency), dtype=bool)
        order = self.frequency * 2 * np.pi / w
        width = self._order_width(w)
        from_half = np.abs(order - np.maximum(np.rint(2 * order), 1.0) / 2)
        keep = (from_half > width) | (order > HALF_ORDERS[-1] + width)
        if width < NARROW:  # a slow drive's orders lie so close that leaving them out would leave nothing
            keep &= np.abs(order - np.maximum(np.rint(order), 1.0)) > width
        if width < WIDEST_FOLDED:  # the kicks of reversals reach beyond half the sample rate and fold down
            image = (self.data.run.rate_hz - self.frequency) * 2 * np.pi / w
            low = self.frequency < FOLDED_FROM * self.data.run.rate_hz
            keep &= low | (np.abs(image - np.rint(image)) > width)
        return np.asarray(keep)


def residuals(likelihood: Likelihood, fit: Fit, runs: Sequence[RunData]) -> list[WindowResidual]:
    """Whitened residuals of all windows of at least four seconds, up to 0.4 of the sample rate."""
    out: list[WindowResidual] = []
    felt: list[tuple[int, Extra]] = []
    told = _told_by_the_accelerometer(runs)
    for data in runs:
        model = predicted(likelihood.effects, likelihood.source, data, fit.templates, fit.beta_in(data.mounting_number))
        on_time = fit.templates.set(DELAY, 0.0)  # only the gyro is late
        force = likelihood.source.of(data, on_time).specific_force
        beyond = [data.run.angular_rate - model]
        if force is not None and np.isfinite(data.run.specific_force).all():
            beyond.append(data.run.specific_force - force)
        both = np.concatenate(beyond, axis=1)
        for window in data.windows:
            if len(window) < 4.0 * data.run.rate_hz:
                continue
            bins = window_bins(len(window), data.run.rate_hz, likelihood.noise, USED_BAND * data.run.rate_hz)
            cut = slice(window.start, window.stop)
            result = WindowResidual(data, window, bins, np.zeros((2, len(bins.frequency), 3)))
            left = result.between_orders(both[cut])
            rows = project_out_slow(whiten(left[:, :3, None], bins), bins)
            result = replace(result, spectrum=rows[:, :, 0].reshape(2, -1, 3))
            if len(beyond) > 1:
                extra = _beyond_the_drive(result, left[:, 3:], model[cut])
                folded = _may_fold(likelihood, fit, result, extra)
                known = result.spectrum - _through_g(likelihood, fit, result, extra)
                result = replace(result, spectrum=known, folded=folded)
                felt.append((len(out), _beside_the_rail(likelihood, fit, result, extra) if told else extra))
            out.append(result)
    cleaned = without_coherent([out[i] for i, _ in felt], [extra for _, extra in felt])
    for (i, _), result in zip(felt, cleaned, strict=True):
        out[i] = result
    return out


def _told_by_the_accelerometer(runs: Sequence[RunData]) -> bool:
    """Whether most motions have from the accelerometer what the encoder does not show.

    Along the rail nothing is then felt beyond them, not even its noise, and a response to that could be anything: at
    rest, where the noise is, it would be taken off.
    """
    motions = [r.motion for r in runs if r.motion is not None and r.motion.moving is not None]
    return 2 * sum(m.beyond is not None for m in motions) > len(motions)


def _beside_the_rail(likelihood: Likelihood, fit: Fit, residual: WindowResidual, extra: Extra) -> Extra:
    """What is felt across the rail alone."""
    mounting = likelihood.source.of(residual.data, fit.templates).mounting
    if mounting is None or mounting.along is None:
        return extra
    unit = mounting.along / np.linalg.norm(mounting.along)
    return replace(extra, felt=extra.felt - np.outer(extra.felt @ unit, unit))


def _beyond_the_drive(residual: WindowResidual, felt: FloatArray, model: FloatArray) -> Extra:
    keep, away = residual.bins.keep, residual.away_from_orders()[:, None]
    above = (residual.frequency > MODEL_ABOVE_HZ)[:, None]
    return Extra(np.fft.rfft(felt, axis=0)[keep] * away, np.fft.rfft(model, axis=0)[keep] * away * above)


def _through_g(likelihood: Likelihood, fit: Fit, residual: WindowResidual, extra: Extra) -> FloatArray:
    """G times what the accelerometer feels away from the drive's orders, whitened, shape (2, m, 3).

    The encoder's harmonics do not reach there; it is the declared G f all the same, and no symptom.
    """
    if "g_sensitivity" not in fit.names:
        return np.zeros_like(residual.spectrum)
    first = likelihood.columns.start["g_sensitivity"]
    G = fit.beta_in(residual.data.mounting_number)[first : first + 9].reshape(3, 3)
    late = np.exp(-2j * np.pi * residual.frequency * fit.templates.gyro_delay_s)[:, None]
    white = ((extra.felt * late) @ G.T + _through_mount(likelihood, fit, residual, extra)) * residual.bins.weight
    return np.stack([white.real, white.imag])


def _through_mount(likelihood: Likelihood, fit: Fit, residual: WindowResidual, extra: Extra) -> ComplexArray:
    """What the effects of the fit that answer to vibration make of what the accelerometer feels, shape (m, 3)."""
    along, answer = (
        _felt_along(likelihood, fit, residual, extra),
        _answer(likelihood, fit, residual, residual.frequency),
    )
    return np.zeros_like(extra.felt) if along is None else np.asarray(along[:, None] * answer)


def _may_fold(likelihood: Likelihood, fit: Fit, residual: WindowResidual, extra: Extra) -> FloatArray | None:
    """What is left at most where a part of what is felt has folded, over the noise's expectation, shape (m, 3).

    Nothing tells which part. A response that grows with frequency makes more of it than of what is felt at its own
    frequency; in halves, a regression on what is felt leaves a quarter of the difference's square.
    """
    along, rate_hz = _felt_along(likelihood, fit, residual, extra), residual.data.run.rate_hz
    known = _answer(likelihood, fit, residual, np.array([HIGHEST_HZ]))
    if along is None or not known.any():
        return None
    frequency = np.where(residual.frequency > FOLDED_FROM * rate_hz, residual.frequency, rate_hz / 2)
    more = np.abs(known) * (rate_hz - 2.0 * frequency)[:, None] / HIGHEST_HZ
    return np.asarray((more * np.abs(along)[:, None] * residual.bins.weight) ** 2 / 8.0)


def _felt_along(likelihood: Likelihood, fit: Fit, residual: WindowResidual, extra: Extra) -> ComplexArray | None:
    """Spectrum of what is felt along the rail, shape (m,); None where its direction is not known."""
    mounting = likelihood.source.of(residual.data, fit.templates).mounting
    return None if mounting is None or mounting.along is None else np.asarray(extra.felt @ mounting.along)


def _answer(likelihood: Likelihood, fit: Fit, residual: WindowResidual, frequency_hz: FloatArray) -> ComplexArray:
    """What the effects of the fit make of a vibration along the rail, by frequency, shape (m, 3)."""
    out = np.zeros((len(frequency_hz), 3), dtype=complex)
    drivers = likelihood.source.of(residual.data, fit.templates)
    beta = fit.beta_in(residual.data.mounting_number)
    for effect in (e for e in likelihood.effects if e.name in fit.names):
        answer = effect.vibration(frequency_hz, drivers)
        if answer is not None:
            out += answer @ beta[likelihood.columns.index(frozenset({effect.name}))]
    return out


@dataclass(frozen=True)
class LineEnergy:
    """A sine in a window's residual, per axis, each of shape (3,)."""

    energy: FloatArray
    """Whitened energy over the local level of the noise."""
    calibrated: FloatArray
    """The same as chi-square with two degrees of freedom where no line is: the level is an estimate from few bins."""
    amplitude_squared: FloatArray
    """(rad/s)^2."""


def line_energies(residual: WindowResidual, frequencies_hz: FloatArray) -> list[LineEnergy]:
    """Energy of a sine at each of some frequencies (k,), between bins too.

    The local level comes from bins that the drive cannot reach; it is never taken below one: a spectrum that the rest
    records overestimate proves nothing, one that they underestimate must not raise alarms.
    """
    k, n = len(frequencies_hz), len(residual.window)
    turned = turning(2 * np.pi * frequencies_hz / residual.data.run.rate_hz, n)
    rows = rows_by_axis(np.concatenate([turned.real, turned.imag]), residual.bins, range(3))
    beside = np.abs(residual.frequency[:, None] - frequencies_hz) < SIDE_BINS * residual.resolution_hz
    rows *= np.tile(beside, (2, 2))
    data = residual.spectrum.reshape(-1, 3).T[:, None]
    (cc, ss), cs = np.split(np.sum(rows**2, axis=1), 2, axis=1), np.sum(rows[:, :, :k] * rows[:, :, k:], axis=1)
    cy, sy = np.split((data @ rows)[:, 0], 2, axis=1)
    det = cc * ss - cs**2
    there = det > SINGULAR * cc * ss  # an axis that is not there has no rows
    safe = np.where(there, det, 1.0)
    cosine, sine = (np.where(there, x / safe, 0.0) for x in (ss * cy - cs * sy, cc * sy - cs * cy))
    found, square = cosine * cy + sine * sy, cosine**2 + sine**2
    free = np.flatnonzero(residual.away_from_orders())
    near = [_beside(residual, free, f) for f in frequencies_hz.tolist()]
    return [_line_energy(residual, places, found[:, i], square[:, i]) for i, places in enumerate(near)]


def _beside(residual: WindowResidual, free: IntArray, frequency_hz: float) -> IntArray:
    """The bins among `free` that tell the level beside a frequency, shape (m,)."""
    middle = int(np.searchsorted(residual.frequency[free], frequency_hz))
    around = free[max(0, middle - LEVEL_BINS) : middle + LEVEL_BINS]
    return around[np.argsort(np.abs(np.log(residual.frequency[around] / frequency_hz)))[:LEVEL_BINS]]


def _line_energy(residual: WindowResidual, near: IntArray, found: FloatArray, square: FloatArray) -> LineEnergy:
    """Of a sine of whitened energy `found` and squared amplitude `square` by axis; `near`: bins that tell the level."""
    m = max(len(near), 1)
    level = np.maximum(1.0, residual.power[near].mean(axis=0)) if len(near) else np.ones(3)
    energy = found / level
    # F with (2, 2m) degrees of freedom has the tail (1 + F/m)^-m; chi-square with 2 has exp(-x/2)
    return LineEnergy(energy, 2 * m * np.log1p(energy / 2 / m), square)
