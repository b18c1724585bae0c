"""The chips' low-pass filters: second order at 1 kHz, of the bandwidth and the delay that the data sheet states."""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy.optimize import brentq

from gsense_rig.sensors.chip_config import FilterSpec
from gsense_rig.sensors.constants import STEP

BUTTERWORTH = math.sqrt(0.5)
_LEAST_DAMPING = 0.1
_HIGHEST_BANDWIDTH = 0.45 / STEP


@dataclass(frozen=True)
class LowPass:
    """Digital biquad y = b * x / a with a[0] = 1, and the delay that it lacks to the data sheet's."""

    b: tuple[float, float, float]
    a1: float
    a2: float
    pure_delay: float
    """s, to be put in front of it."""


def design(spec: FilterSpec) -> LowPass:
    """Second-order low-pass of the spec, bilinear with the -3 dB point pre-warped.

    A longer delay than a Butterworth's is pure delay (sampling and decimation); a shorter one means less damping.
    """
    bandwidth = min(spec.bandwidth, _HIGHEST_BANDWIDTH)
    corner = 2.0 / STEP * math.tan(math.pi * bandwidth * STEP)
    damping = BUTTERWORTH
    if spec.delay is not None and spec.delay < _delay(BUTTERWORTH, corner):
        damping = brentq(lambda zeta: _delay(zeta, corner) - spec.delay, _LEAST_DAMPING, BUTTERWORTH)
    pure = 0.0 if spec.delay is None else max(0.0, spec.delay - _delay(damping, corner))
    b, a1, a2 = _bilinear(damping, corner / _corner_ratio(damping))
    return LowPass(b, a1, a2, pure)


def mode(frequency: float, damping: float) -> LowPass:
    """A mass on an elastic mount, f0^2 / (f0^2 - f^2 + 2i damping f0 f); `frequency` in Hz, well below 500."""
    b, a1, a2 = _bilinear(damping, 2.0 * math.pi * frequency)
    return LowPass(b, a1, a2, 0.0)


def _corner_ratio(damping: float) -> float:
    """-3 dB frequency over natural frequency of a second-order low-pass."""
    h = 1.0 - 2.0 * damping**2
    return math.sqrt(h + math.sqrt(h * h + 1.0))


def _delay(damping: float, corner: float) -> float:
    """Group delay at zero frequency, 2 zeta / w0; the bilinear transform keeps it."""
    return 2.0 * damping * _corner_ratio(damping) / corner


def _bilinear(damping: float, natural: float) -> tuple[tuple[float, float, float], float, float]:
    w = natural * STEP / 2.0
    norm = 1.0 + 2.0 * damping * w + w * w
    gain = w * w / norm
    return (gain, 2.0 * gain, gain), 2.0 * (w * w - 1.0) / norm, (1.0 - 2.0 * damping * w + w * w) / norm
