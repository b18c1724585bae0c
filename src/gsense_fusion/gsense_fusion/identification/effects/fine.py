"""Series that change within a sample: made on a finer grid, passed through the gyro's filter, then sampled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from gsense_fusion.identification.effects.base import Drivers
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.types import FloatArray

FINE_HZ = 800.0


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
        seen = response is not None and response.filtered
        if not seen and not means:
            return series[:: self.per_sample]
        if not series.any():
            return np.zeros(len(series[:: self.per_sample]))
        n = next_fast_len(len(series) + self.per_sample, real=True)
        frequency = rfftfreq(n, self.step_s)
        if response is not None and seen:
            gain = response.on_grid(n, self.step_s)
        else:
            gain = np.sinc(frequency * self.step_s * self.per_sample).astype(complex)
        if means:
            gain = gain / np.sinc(frequency * self.step_s)
        return np.asarray(irfft(rfft(series, n) * gain, n)[: len(series) : self.per_sample])


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
