"""Series that change within a sample: made on a finer grid, passed through the gyro's filter, then sampled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from gsense_fusion.identification.effects.base import Drivers
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.types import ComplexArray, FloatArray

FINE_HZ = 800.0
LATEST_S = 0.8
"""How much later than the motion a series may go on: the longest delay, and ten times the longest lag."""


@dataclass(frozen=True, eq=False)
class FineGrid:
    """Points between the samples, m of them, the first at the first sample, the last at the last."""

    per_sample: int
    step_s: float

    def sampled(self, series: FloatArray, response: Response | None, *, means: bool = False) -> FloatArray:
        """A series on this grid (m,) that is zero at both ends as the gyro reports it, shape (n,).

        Args:
            series: Its values at the grid's points.
            response: The gyro's filter.
            means: The values are means over the grid's intervals, of pulses. Without a filter that could be seen each
                sample then has the mean over its own: a pulse shorter than a sample stays one of the right area.

        """
        if not means and (response is None or not response.filtered):
            return series[:: self.per_sample]
        samples = len(series[:: self.per_sample])
        if not series.any():
            return np.zeros(samples)
        spectrum = self.spectrum(series)
        return self.of_spectrum(spectrum * self.gain(spectrum, response, means=means), samples)

    def spectrum(self, series: FloatArray) -> ComplexArray:
        """Of a series on this grid that is zero at both ends, with room behind it for what comes late."""
        samples = len(series[:: self.per_sample]) + round(LATEST_S / (self.step_s * self.per_sample))
        return np.asarray(rfft(series, self.per_sample * 2 * next_fast_len((samples + 1) // 2, real=True)))

    def gain(self, spectrum: ComplexArray, response: Response | None, *, means: bool) -> ComplexArray:
        """What the gyro's filter leaves of each frequency of a spectrum; the last two as `sampled` has them."""
        n = self._length(spectrum)
        if response is not None and response.filtered:
            gain = response.on_grid(n, self.step_s)
        else:
            gain = np.sinc(rfftfreq(n, self.step_s) * self.step_s * self.per_sample).astype(complex)
        return gain / np.sinc(rfftfreq(n, self.step_s) * self.step_s) if means else gain

    def late(self, spectrum: ComplexArray, delay_s: float = 0.0, lag_s: float = 0.0) -> ComplexArray:
        """What makes a spectrum's series late by a delay and a first-order lag, up to `LATEST_S` in all."""
        n = self._length(spectrum)
        gain = np.ones(len(spectrum), dtype=complex)
        if delay_s:
            gain = _turns(2 * np.pi * delay_s / (n * self.step_s), len(spectrum))
        return gain / (1 + 2j * np.pi * rfftfreq(n, self.step_s) * lag_s) if lag_s else gain

    def of_spectrum(self, spectrum: ComplexArray, samples: int) -> FloatArray:
        """The samples (n,) of the series with a spectrum: those between them are not made."""
        n = self._length(spectrum)
        whole = np.concatenate([spectrum, spectrum[1 : n // 2].conj()[::-1]])
        folded = whole.reshape(self.per_sample, -1).mean(axis=0)
        return np.asarray(irfft(folded[: len(folded) // 2 + 1], len(folded))[:samples])

    @staticmethod
    def _length(spectrum: ComplexArray) -> int:
        """Points of the series that a spectrum is of: an even number."""
        return 2 * (len(spectrum) - 1)


@dataclass(frozen=True, eq=False)
class Fine(FineGrid):
    """The carriage's motion on such a grid."""

    time: FloatArray
    """s, shape (m,)."""
    position: FloatArray
    velocity: FloatArray


def fine_motion(drivers: Drivers, fine_hz: float = FINE_HZ) -> Fine:
    """The motion between the samples by Hermite's cubics, which its derivatives give."""
    kin, time = drivers.kinematics, drivers.time
    step = float(np.median(np.diff(time)))
    k = max(1, int(np.ceil(fine_hz * step)))
    return Fine(
        k,
        step / k,
        np.append((time[:-1, None] + step * np.arange(k) / k).ravel(), time[-1]),
        _between(kin.position, kin.velocity * step, k),
        _between(kin.velocity, kin.acceleration * step, k),
    )


def _between(value: FloatArray, slope: FloatArray, k: int) -> FloatArray:
    """Hermite's cubic through values with their change per sample (n,), k points a sample, shape ((n - 1) k + 1,)."""
    x = np.arange(k) / k
    basis = np.stack([(1 + 2 * x) * (1 - x) ** 2, x * (1 - x) ** 2, x**2 * (3 - 2 * x), x**2 * (x - 1)])
    inner = np.stack([value[:-1], slope[:-1], value[1:], slope[1:]], axis=1) @ basis
    return np.append(inner.ravel(), value[-1])


def _turns(angle: float, n: int) -> ComplexArray:
    """exp(-i k angle) for k below n, from the products of some hundred."""
    block = int(np.ceil(np.sqrt(n)))
    k = np.arange(block)
    return np.asarray(np.outer(np.exp(-1j * angle * block * k), np.exp(-1j * angle * k)).ravel()[:n])
