"""Where to begin the search of a parameter that no fixed grid can cover: the residual itself says it."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.likelihood.bins import USED_BAND, window_bins
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.likelihood.slow import Drift, SlowNoise
from gsense_fusion.identification.likelihood.store import predicted
from gsense_fusion.identification.search.alternatives import slow_residual, step_places, steps
from gsense_fusion.identification.types import FloatArray

TRIED = 3
POSITION_STEP = 1e-4
"""m: ripples down to twice this are seen."""
LONGEST_PITCH = 0.04
SHORTEST_PITCH = 5e-4
CONSPICUOUS = 9.0
"""Times its neighbourhood's median that a ripple's power must have: 1 in 500 of what noise alone shows."""
PADDING = 4
PEAK_BINS = 160
"""40 periods a metre: a line's neighbourhood."""


def screened(field: str, likelihood: Likelihood, fit: Fit) -> tuple[float, ...]:
    """Values of a searched parameter that are worth a try beside the model `fit`; empty where none is."""
    if field == "jump_time_s":
        return jump_times(likelihood, fit)
    if field == "tooth_pitch_m":
        return pitches(likelihood, fit)
    raise KeyError(field)


def jump_times(likelihood: Likelihood, fit: Fit) -> tuple[float, ...]:
    """Between which blocks a step of the bias gains most, drift being as at rest, s."""
    blocks = likelihood.blocks
    residual = slow_residual(likelihood, fit)
    column = steps(blocks, remounted=False)
    gain = np.zeros(column.shape[1])
    for axis, slow in likelihood.slow.items():
        for drift in (fit.drift[axis], likelihood.rest_drift[axis]):
            gain += step_gains(slow, column, residual[:, axis], drift)[0]
    gains = zip(gain.tolist(), step_places(blocks, remounted=False).tolist(), strict=True)
    best = sorted(gains, reverse=True)[:TRIED]
    return tuple(float(blocks.time[i] - blocks.duration[i] / 2) for _, i in best)


def instants_about(likelihood: Likelihood, instant: float, step: float) -> FloatArray:
    """Instants a step apart in the block that an instant is in, or that follows it, and in the one before, s.

    Block means tell no more: what steps within a block looks like a step at either end of it, and the gap between two
    blocks is a top of its own beside it. Blocks are whole: what is left of their stretch at its end counts with them.
    """
    ranges = np.array([_stretch(likelihood, number, block) for number, block in likelihood.cuts])
    ranges = ranges[np.argsort(ranges[:, 0])]
    at = min(int(np.searchsorted(ranges[:, 1], instant, side="right")), len(ranges) - 1)
    near = ranges[max(at - 1, 0) : at + 1]
    return np.concatenate([np.linspace(a, b, 1 + max(1, round((b - a) / step))) for a, b in near])


def _stretch(likelihood: Likelihood, number: int, block: Window) -> tuple[float, float]:
    """A block's first and last instant, s; the last block of a steady stretch reaches to the end of that."""
    data = likelihood.campaign.fit[number]
    whole = next(w for w in data.windows if w.start <= block.start and block.stop <= w.stop)
    later = any(n == number and block.stop <= b.start < whole.stop for n, b in likelihood.cuts)
    stop = block.stop if later else whole.stop
    return float(data.run.time[block.start]), float(data.run.time[stop - 1])


def step_gains(
    slow: SlowNoise, columns: FloatArray, residual: FloatArray, drift: Drift
) -> tuple[FloatArray, FloatArray]:
    """What each column (b, k) by itself gains in twice the log-likelihood, and its size in rad/s, each (k,)."""
    gram = slow.gram(columns, residual, drift)
    information = np.diag(gram.xx)
    seen = information > 0
    safe = np.where(seen, information, 1.0)
    return np.where(seen, gram.xy**2 / safe, 0.0), np.where(seen, gram.xy / safe, 0.0)


def pitches(likelihood: Likelihood, fit: Fit) -> tuple[float, ...]:
    """Pitches in m at which the whitened residual, seen over position, has its highest lines.

    Looked at as a rate, and as an angle, whose rate changes its sign with the direction.
    """
    length = round(1.0 / POSITION_STEP)  # a metre of rail
    profile = np.zeros((2, length, 3))
    for data in likelihood.campaign.fit:
        if not any(w.moving for w in data.windows):
            continue
        rate = data.run.angular_rate - predicted(likelihood.effects, likelihood.source, data, fit.templates, fit.beta)
        drivers = likelihood.source.of(data, fit.templates)
        kin = drivers.kinematics
        turned = None if drivers.mounting is None else drivers.mounting.sensor_from_rail
        rail = np.eye(3) if turned is None else turned
        for window in data.windows:
            if not window.moving:
                continue
            cut = slice(window.start, window.stop)
            bins = window_bins(len(window), data.run.rate_hz, likelihood.noise, USED_BAND * data.run.rate_hz)
            spectrum = np.zeros((len(window) // 2 + 1, 3), dtype=complex)
            spectrum[bins.keep] = np.fft.rfft(rate[cut], axis=0)[bins.keep] * bins.weight**2
            white = np.fft.irfft(spectrum, len(window), axis=0) @ rail  # a turned board's ripples add to the others'
            cell = np.floor(kin.position[cut] / POSITION_STEP).astype(int) % length
            for axis in range(3):
                profile[0, :, axis] += np.bincount(cell, white[:, axis], length)
                profile[1, :, axis] += np.bincount(cell, white[:, axis] * kin.velocity[cut], length)
    power = np.sum(np.abs(np.fft.rfft(profile, PADDING * length, axis=1)) ** 2, axis=2)
    lines = sorted(_peaks(power[0], PEAK_BINS) + _peaks(power[1], PEAK_BINS), reverse=True)
    humps = _peaks(power[0], power.shape[1]) + _peaks(power[1], power.shape[1])
    best = list(dict.fromkeys(pitch for _, pitch in lines))[:TRIED]
    return tuple(dict.fromkeys([*best, *(pitch for _, pitch in humps)]))


def _peaks(power: FloatArray, width: int) -> list[tuple[float, float]]:
    """Conspicuous lines of a power spectrum over position with PADDING bins per 1/m: how much, and the pitch in m.

    One at most in every `width` bins, over their median. Where the gyro's filter leaves a ripple only near the ends of
    the stroke, it is seen over so short a way that it raises its whole neighbourhood.
    """
    per_metre = np.arange(len(power)) / PADDING
    low, high = round(PADDING / LONGEST_PITCH), round(PADDING / SHORTEST_PITCH)
    found: list[tuple[float, float]] = []
    for first in range(low, high, width):
        part = power[first : min(first + width, high)]
        level = float(np.median(part))
        k = first + int(np.argmax(part))
        if level > 0 and power[k] > CONSPICUOUS * level:
            found.append((float(power[k] / level), float(1.0 / per_metre[k])))
    return found
