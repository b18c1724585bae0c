"""Tones that are there at rest: noise, not a missing effect. What they leak into in a window is left out with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.types import FloatArray

TONE_FALSE_ALARM = 1e-4
LOWEST_TONE_HZ = 1.0
LEAKAGE = 0.3
"""Part of the noise's own power that a tone may leak into a bin: many windows together show a tenth."""
LEAST_BINS = 1.5
FREQUENCY_ERROR_HZ = 0.01


@dataclass(frozen=True)
class Tone:
    """A tone at rest."""

    frequency_hz: float
    strength: float
    """Power over the noise's density in its bin for each second of the window."""

    def reach_hz(self, resolution_hz: float) -> float:
        """How far from it a window without taper shows it: its power falls with 1 / (pi bins)^2."""
        bins = np.sqrt(self.strength / resolution_hz / LEAKAGE) / np.pi
        return float(max(LEAST_BINS, bins) * resolution_hz + FREQUENCY_ERROR_HZ)


def tones_of(windows: Sequence[tuple[FloatArray, FloatArray]]) -> tuple[Tone, ...]:
    """Tones in windows at rest, in order of frequency.

    Args:
        windows: Of each the frequencies of its bins in Hz and their power over the noise's density, each (m,).

    """
    seen: list[tuple[Tone, float]] = []
    for frequency, excess in windows:
        threshold = np.log(len(excess) / TONE_FALSE_ALARM)
        resolution = float(frequency[0])
        strong = np.flatnonzero((excess > threshold) & (frequency > LOWEST_TONE_HZ))
        seen += [(Tone(float(frequency[i]), float(excess[i]) * resolution), resolution) for i in strong]
    seen.sort(key=lambda s: -s[0].strength)
    tones: list[Tone] = []
    for tone, resolution in seen:
        if all(abs(tone.frequency_hz - t.frequency_hz) > t.reach_hz(resolution) for t in tones):
            tones.append(tone)
    return tuple(sorted(tones, key=lambda t: t.frequency_hz))
