"""Noise that is there in one run, at one place or in one phase alone: pooled it may be too little to be seen.

A mode that chatters near one speed is a narrow band of one run; a dent, dirt or a splice makes noise where the carriage
passes it; what is loose rattles where it is accelerated. Each run's power is taken over its own mean, so that broadband
noise that grows with the speed from run to run is none of these.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from scipy.stats import f as fisher
from scipy.stats import norm

from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.types import BoolArray, FloatArray
from gsense_fusion.identification.verdict.fast_part import LOWEST_HZ, away_above, fast_part, in_blocks
from gsense_fusion.identification.verdict.residual import FOLDED_FROM, WindowResidual

BAND = 1.26
"""Width of a narrow band: a third of an octave."""
LEAST_BINS = 20
LEAST_LEVEL = 0.5
"""Of the noise at rest: what the other runs have is held above. A strong tone at rest raises its expectation around it,
and what the tone leaks differs with the length of the window."""
UNSTEADY = 0.04
"""Relative error of a run's level in a band beyond that of its ordinates: noise is not quite steady."""
KINDS = 4
"""With the bursts."""
PLACES = 12
"""Parts of the travel."""
BLOCK_S = 0.02
CONFIRMED_ALPHA = 0.01
"""Chance of what is left without the run that shows it most, and of what one part of the rail shows."""
PARTS_OF_THE_RAIL: tuple[Callable[[FloatArray], BoolArray], ...] = (
    lambda side: side > 0.0,
    lambda side: side < 0.0,
    lambda side: np.abs(side) > MIDDLE,
)
MIDDLE = 0.5
"""Of the travel, where the carriage is fast and what is there looks like it."""
LEAST_BLOCKS = 50
LAGS = 5
"""Neighbours that a block may be correlated with, where the band is narrow."""


@dataclass(frozen=True)
class Uneven:
    """Where the noise stands out most."""

    p_value: float
    """With the number of looks."""
    axis: int
    rate_rms: float
    """What is too much there, rad/s."""
    words: str

    def after(self, looks: int) -> Uneven:
        """The same with the number of looks."""
        return replace(self, p_value=min(1.0, looks * self.p_value))


@dataclass(frozen=True, eq=False)
class Blocks:
    """Short blocks of one window."""

    position: FloatArray
    """m, shape (b,)."""
    mirror: FloatArray
    """As far beyond the middle of the travel, m, shape (b,)."""
    exertion: FloatArray
    """Square of the acceleration beyond the window's mean, (m/s^2)^2, shape (b,)."""
    speed: FloatArray
    """Square of the speed beyond the window's mean, (m/s)^2, shape (b,)."""
    root: FloatArray
    """Cube root of the power over the window's mean: nearly normal (Wilson and Hilferty, 1931), shape (b, 3)."""


def uneven_noise(likelihood: Likelihood, fit: Fit, moving: Sequence[WindowResidual]) -> list[Uneven]:
    """The most significant of each kind in the residual of a fit."""
    highest_hz = not_folded(likelihood, fit)
    rows = [_blocks(likelihood, w, highest_hz) for w in moving]
    found = [narrow_band(moving)]
    if rows:
        found += [one_place(rows, moving[0]), where_accelerated(rows, moving[0])]
    return [x for x in found if x is not None]


def narrow_band(moving: Sequence[WindowResidual]) -> Uneven | None:
    """A third of an octave's part in the power of one window against that in the others; None without two windows."""
    moving = [w for w in moving if away_above(w).any()]
    level = [np.maximum(w.power[away_above(w)].mean(axis=0), 1e-30) for w in moving]
    top = max((float(w.frequency[-1]) for w in moving), default=0.0)
    edges = [LOWEST_HZ]
    while edges[-1] * np.sqrt(BAND) < top:
        edges.append(edges[-1] * np.sqrt(BAND))
    best: Uneven | None = None
    looks = 0
    for low, high in zip(edges, edges[2:], strict=False):  # what straddles an edge lies in the middle of the next
        used = [(w.frequency >= low) & (w.frequency < high) & w.away_from_orders() for w in moving]
        windows = [(w, u, own) for w, u, own in zip(moving, used, level, strict=True) if u.sum() >= LEAST_BINS]
        if len(windows) < 2:
            continue
        # bins without weight (rounding, a tone at rest) are no ordinates
        told = np.stack([(w.bins.weight[u] > 0).sum(axis=0) for w, u, _ in windows])
        count, rest = np.maximum(told, 1.0), np.maximum(told.sum(axis=0) - told, 1.0)
        power = np.stack([w.power[u].sum(axis=0) / own for w, u, own in windows])
        others = np.maximum((power.sum(axis=0) - power) / rest, LEAST_LEVEL)
        free = 1.0 / (1.0 / rest + UNSTEADY**2)
        p = np.where(told < LEAST_BINS, 1.0, fisher.sf(_over(power / count, others), 2 * count, 2 * free))
        looks += p.size
        i, axis = np.unravel_index(int(np.argmin(p)), p.shape)
        if best is None or p[i, axis] < best.p_value:
            words = f"noise of {low:.3g} to {high:.3g} Hz in one run alone, {_speed(windows[i][0])}"
            window, bins, own = windows[i]
            excess = float(own[axis] * (power[i, axis] / count[i, axis] - others[i, axis]))
            best = Uneven(float(p[i, axis]), int(axis), excess_rms(window, bins, int(axis), excess), words)
    return best.after(looks) if best is not None else None


def one_place(rows: Sequence[Blocks], window: WindowResidual) -> Uneven | None:
    """Power at one part of the rail against where the same runs are as far beyond their middle.

    There the carriage passes at the same speed: noise that only grows with it is at no place.
    """
    position, mirror = (np.concatenate([getattr(r, name) for r in rows]) for name in ("position", "mirror"))
    root, inflation = np.concatenate([r.root for r in rows]), _inflation(rows)
    best: Uneven | None = None
    looks = 0
    for low, high in itertools.pairwise(np.linspace(position.min(), position.max(), PLACES + 1)):
        at, opposite = _within(position, low, high), _within(mirror, low, high)
        here, there = root[at & ~opposite], root[opposite & ~at]
        if min(len(here), len(there)) < LEAST_BLOCKS:
            continue
        z = _louder(here, there, inflation)
        looks += len(z)
        axis = int(np.argmax(z))
        p = float(norm.sf(z[axis]))
        if best is None or p < best.p_value:
            excess = float(np.mean(here[:, axis] ** 3) - np.mean(there[:, axis] ** 3))
            rms = excess_rms(window, away_above(window), axis, excess)
            best = Uneven(p, axis, rms, f"more noise at one place of the rail, {low:.3f} to {high:.3f} m")
    return best.after(looks) if best is not None else None


def where_accelerated(rows: Sequence[Blocks], window: WindowResidual) -> Uneven | None:
    """Power against the square of the acceleration within each run; None where nothing is accelerated.

    One-sided: noise that grows with the speed falls with the acceleration of a sine.
    """
    return _rising(rows, [r.exertion for r in rows], window, "more noise where the carriage is accelerated")


def where_fast(likelihood: Likelihood, fit: Fit, moving: Sequence[WindowResidual]) -> list[Uneven]:
    """Power against the square of the speed within each run; empty where one run or one place alone shows it.

    How steady the noise is from run to run does not matter here, as it does to `growing_noise`.
    """
    highest_hz = not_folded(likelihood, fit)
    rows = [_blocks(likelihood, w, highest_hz) for w in moving]
    words = "more noise in each run where the carriage is fast"
    found = _rising(rows, [r.speed for r in rows], moving[0], words) if len(rows) > 1 else None
    if found is None:
        return []
    strongest = int(np.argmax([r.speed @ r.root[:, found.axis] for r in rows]))
    side = [(r.position - r.mirror) / max(float(np.ptp(r.position)), 1e-30) for r in rows]  # -1 to 1
    places = ([_part(r, at(x)) for r, x in zip(rows, side, strict=True)] for at in PARTS_OF_THE_RAIL)
    for part in (rows[:strongest] + rows[strongest + 1 :], *places):
        confirmed = _rising(part, [r.speed - r.speed.mean() for r in part], moving[0], words)
        if confirmed is None or confirmed.p_value > CONFIRMED_ALPHA:
            return []
    return [found]


def _part(blocks: Blocks, keep: BoolArray) -> Blocks:
    """Some of the blocks of a window; all where there are none."""
    if not keep.any():
        return blocks
    return Blocks(*(getattr(blocks, f.name)[keep] for f in fields(Blocks)))


def _rising(rows: Sequence[Blocks], drivers: Sequence[FloatArray], window: WindowResidual, words: str) -> Uneven | None:
    """Power against a driver of mean zero within each run, (b,) each, one-sided; None where nothing drives."""
    driver = np.concatenate(drivers)[:, None]
    root = np.concatenate([r.root - r.root.mean(axis=0) for r in rows])
    error = np.sqrt(np.sum((driver * root) ** 2, axis=0) * _inflation(rows))
    if not (error > 0).any():
        return None
    z = np.sum(driver * root, axis=0) / np.where(error > 0, error, np.inf)
    axis = int(np.argmax(z))
    all_axes = float(z.sum() / np.sqrt(max(int((error > 0).sum()), 1)))
    high = driver[:, 0] > np.quantile(driver, 0.75)
    cubes = np.concatenate([r.root[:, axis] ** 3 for r in rows])
    rms = excess_rms(window, away_above(window), axis, float(cubes[high].mean() - cubes[~high].mean()))
    p = (len(z) + 1) * float(norm.sf(max(float(z[axis]), all_axes)))
    return Uneven(min(1.0, p), axis, rms, words)


def not_folded(likelihood: Likelihood, fit: Fit) -> float:
    """Up to where the felt force says what a kick makes of the gyro, Hz.

    What folds from above half the sample rate does so alike in G f. What answers to the force's rate of change gives
    it another weight than what is felt at the frequency that it folds to, and the one cannot be taken off by the other.
    """
    answers = any(e.name in fit.names and type(e).vibration is not Effect.vibration for e in likelihood.effects)
    return FOLDED_FROM * likelihood.campaign.rate_hz if answers else np.inf


def _blocks(likelihood: Likelihood, window: WindowResidual, highest_hz: float) -> Blocks:
    length = max(2, round(BLOCK_S * window.data.run.rate_hz))
    kin = likelihood.source.of(window.data, Templates()).kinematics
    cut = slice(window.window.start, window.window.stop)
    series = np.column_stack([kin.position, kin.acceleration**2, kin.velocity**2])[cut]
    position, force, speed = in_blocks(series, length).T
    power = in_blocks(fast_part(window, highest_hz) ** 2, length)
    middle = float(position.min() + position.max()) / 2
    root = np.cbrt(power / np.maximum(power.mean(axis=0), 1e-30))
    return Blocks(position, 2 * middle - position, force - force.mean(), speed - speed.mean(), root)


def _inflation(rows: Sequence[Blocks]) -> FloatArray:
    """How many times neighbours that are alike make the variance of a mean larger, shape (3,)."""
    deviations = [r.root - r.root.mean(axis=0) for r in rows]
    square = np.maximum(sum(np.sum(d**2, axis=0) for d in deviations), 1e-30)
    alike = [sum(np.sum(d[k:] * d[:-k], axis=0) for d in deviations) / square for k in range(1, LAGS + 1)]
    return np.asarray(1.0 + 2.0 * np.sum(np.maximum(alike, 0.0), axis=0))


def _louder(here: FloatArray, there: FloatArray, inflation: FloatArray) -> FloatArray:
    """Standard errors by which the blocks (k, 3) of one place exceed those of another, shape (3,)."""
    variance = here.var(axis=0) / len(here) + there.var(axis=0) / len(there)
    return np.asarray((here.mean(axis=0) - there.mean(axis=0)) / np.sqrt(np.maximum(variance * inflation, 1e-30)))


def _within(position: FloatArray, low: float, high: float) -> BoolArray:
    return np.asarray((position >= low) & (position < high))


def excess_rms(window: WindowResidual, used: BoolArray, axis: int, excess: float) -> float:
    """Of so many times the noise at rest in some bins of an axis, rad/s."""
    weight = window.bins.weight[used, axis]
    variance = float(np.sum(4.0 / weight[weight > 0] ** 2)) / len(window.window) ** 2
    return float(np.sqrt(max(excess, 0.0) * variance))


def _over(power: FloatArray, level: FloatArray) -> FloatArray:
    """Ratio of powers; one where an axis is absent or a coarse step leaves nothing."""
    return np.divide(power, level, out=np.ones_like(power), where=level > 0)


def _speed(window: WindowResidual) -> str:
    w = window.angular_frequency
    return f"at {w:.3g} rad/s" if w is not None else f"bag {window.data.run.name}"
