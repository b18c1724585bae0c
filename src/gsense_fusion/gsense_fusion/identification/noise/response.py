"""The gyro's filter, as the noise that passed through it shows it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq
from scipy.optimize import least_squares

from gsense_fusion.identification.noise.spectrum import PARAMETRIC_BELOW_HZ, NoiseModel
from gsense_fusion.identification.types import ComplexArray, FloatArray

RESPONSE_POINTS = 120
NOT_FILTERED = 0.93
SECOND_ORDER_RMS = 0.15
"""Of the logarithm of the power: by how much a spectrum at rest may miss a filter of second order."""
PHASE_POINTS = 1 << 13
PHASE_TO_HZ = 4096.0
"""Up to where the amplitude counts for the phase: its logarithm falls slowly, what is beyond adds a delay alone."""
DELAY_KNOWN_HZ = 10.0
"""The delay between encoder and IMU, which is taken out before, is that of the filter below this."""


@dataclass(frozen=True, eq=False)
class Response:
    """What the sensor's filter leaves of a signal, the common delay excepted."""

    frequency: FloatArray
    """Hz, shape (k,), increasing."""
    gain: FloatArray
    """Shape (k,); above one where a filter peaks before it falls."""

    @staticmethod
    def of(noise: Mapping[int, NoiseModel], rate_hz: float | None = None) -> Response:
        """Ratio of the smoothed spectrum to its level between 4 and 10 Hz; one where the noise is not filtered.

        A filter of second order is known better by its two parameters: one of a short delay is damped less than a
        Butterworth and peaks by a tenth before it falls, which turns its phase by as much as its delay does.

        Args:
            noise: Models by axis.
            rate_hz: Where given, what sampling folds down from above half of it is taken out of the ratio.

        """
        highest = max(float(m.shape_hz[-1]) for m in noise.values())
        frequency = np.linspace(PARAMETRIC_BELOW_HZ, max(highest, 2 * PARAMETRIC_BELOW_HZ), RESPONSE_POINTS)
        flat = frequency <= max(10.0, frequency[3])
        ratio = np.mean([m.psd(frequency) / np.mean(m.psd(frequency)[flat]) for m in noise.values()], axis=0)
        if ratio[-1] <= NOT_FILTERED**2 and (plain := _second_order(frequency, ratio, rate_hz)) is not None:
            return Response(frequency, plain)
        if rate_hz is not None:
            ratio = _unfolded(frequency, ratio, rate_hz)
        gain = np.sqrt(np.clip(ratio, 0.0, 1.0))
        return Response(frequency, np.where(gain > NOT_FILTERED, 1.0, gain))

    @property
    def filtered(self) -> bool:
        """Whether a filter has begun within the recorded band."""
        return float(self.gain[-1]) < 1.0

    def at(self, frequency: FloatArray) -> FloatArray:
        """Amplitude at the frequencies in Hz; beyond what was recorded a filter goes on in second order."""
        last, gain = float(self.frequency[-1]), float(self.gain[-1])
        inside = np.interp(frequency, self.frequency, self.gain)
        if gain == 1.0:
            return np.asarray(inside)
        return np.asarray(np.where(frequency > last, gain * (last / np.maximum(frequency, last)) ** 2, inside))

    @cached_property
    def _lag(self) -> tuple[FloatArray, FloatArray]:
        """Frequencies, and by how much the filter lags there behind its delay at low frequencies, rad."""
        # a stable filter without zeros outside the circle: its phase is the Hilbert transform of its log amplitude
        frequency = np.linspace(0.0, PHASE_TO_HZ, PHASE_POINTS + 1)
        cepstrum = irfft(np.log(np.maximum(self.at(frequency), 1e-6)))
        half = len(cepstrum) // 2
        cepstrum[1:half] *= 2.0
        cepstrum[half + 1 :] = 0.0
        lag = -np.unwrap(rfft(cepstrum).imag)
        low = frequency <= DELAY_KNOWN_HZ
        return frequency, lag - frequency * float(frequency[low] @ lag[low]) / float(frequency[low] @ frequency[low])

    def transfer(self, frequency: FloatArray) -> ComplexArray:
        """Amplitude and phase at the frequencies in Hz, the delay at low frequencies excepted."""
        return np.asarray(self.at(frequency) * np.exp(-1j * np.interp(frequency, *self._lag)))

    def passed(self, series: FloatArray, rate_hz: float) -> FloatArray:
        """What the filter leaves of a series (n,) that begins and ends alike."""
        if not series.any():
            return np.zeros(len(series))
        n = next_fast_len(len(series), real=True)
        padded = np.concatenate([series, np.full(n - len(series), series[-1])])
        return np.asarray(irfft(rfft(padded) * self.on_grid(n, 1 / rate_hz), n)[: len(series)])

    def on_grid(self, n: int, step_s: float) -> ComplexArray:
        """`transfer` at the frequencies of the spectrum of n real samples, remembered."""
        key = (n, step_s)
        if key not in self._gains:
            self._gains[key] = self.transfer(rfftfreq(n, step_s))
        return self._gains[key]

    @cached_property
    def _gains(self) -> dict[tuple[int, float], ComplexArray]:
        return {}


def _second_order(frequency: FloatArray, ratio: FloatArray, rate_hz: float | None) -> FloatArray | None:
    """Amplitude of the low-pass of second order that a spectrum's ratio shows, shape (k,); None where it shows another.

    What sampling folds down is in the ratio, and in what is fitted to it.
    """

    def power(at: FloatArray, corner: float, damping: float) -> FloatArray:
        x = (at / corner) ** 2
        return np.asarray(1.0 / ((1.0 - x) ** 2 + 4.0 * damping**2 * x))

    def missed(logs: FloatArray) -> FloatArray:
        level, corner, damping = np.exp(logs)
        seen = power(frequency, corner, damping)
        if rate_hz is not None:
            seen = seen + power(rate_hz - frequency, corner, damping)
        return np.asarray(np.log(level * seen) - measured)

    measured = np.log(np.maximum(ratio, 1e-6))
    half = float(frequency[int(np.argmin(np.abs(ratio - 0.5)))])
    with np.errstate(over="ignore", invalid="ignore"):  # a step too far is not finite, and taken back
        found = least_squares(missed, np.log([1.0, half, np.sqrt(0.5)]))
    if not found.success or np.sqrt(np.mean(found.fun**2)) > SECOND_ORDER_RMS:
        return None
    return np.asarray(np.sqrt(power(frequency, *np.exp(found.x[1:]))))


def _unfolded(frequency: FloatArray, ratio: FloatArray, rate_hz: float) -> FloatArray:
    """A spectrum's ratio without what sampling folded onto it: a filter that has begun goes on in second order."""
    last = float(frequency[-1])
    mirrored = rate_hz - frequency
    if ratio[-1] > NOT_FILTERED**2 or mirrored[-1] <= 0.0:
        return ratio
    own = ratio[-1] / (1.0 + (last / mirrored[-1]) ** 4)
    return np.asarray(np.maximum(ratio - own * (last / mirrored) ** 4, 0.0))
