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
MISSED_EXCESS = 20.0
"""Power over noise from which a window would show a tone for certain."""
MISSED_POWER = 0.1
MISSED_PART = 0.3
"""Of the time at rest that would show a tone: where it is missing for longer, it does not belong to the rest."""


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

    A motor's hum goes on while the carriage waits for its run to begin: long rests that lack it say that it is no
    noise.

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
        new = all(abs(tone.frequency_hz - t.frequency_hz) > t.reach_hz(resolution) for t in tones)
        if new and _missing_part(tone, resolution, windows) <= MISSED_PART:
            tones.append(tone)
    return tuple(sorted(tones, key=lambda t: t.frequency_hz))


def _missing_part(tone: Tone, seen_hz: float, windows: Sequence[tuple[FloatArray, FloatArray]]) -> float:
    """Part of the time of the windows that would show a tone in which it is not there; known to `seen_hz`."""
    missing = total = 0.0
    for frequency, excess in windows:
        resolution = float(frequency[0])
        expected = tone.strength / resolution
        near = np.abs(frequency - tone.frequency_hz) < tone.reach_hz(resolution) + seen_hz
        if expected < MISSED_EXCESS or not near.any():
            continue
        total += 1.0 / resolution
        missing += float(np.sum(excess[near] - 1.0) < MISSED_POWER * expected) / resolution
    return missing / total if total else 0.0
