"""Is anything left? Tests of the residual against the noise model, each with its number of looks accounted for.

A whole family of tests may raise a false alarm with the probability `FAMILY_ALPHA`; the families share it equally.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.search.alternatives import beside, gravity_columns, slow_residual
from gsense_fusion.identification.search.screening import step_gains
from gsense_fusion.identification.types import AXES, BoolArray, FloatArray
from gsense_fusion.identification.verdict.bands import louder_band
from gsense_fusion.identification.verdict.bursts import bursts
from gsense_fusion.identification.verdict.courses import courses
from gsense_fusion.identification.verdict.exertion import exertion
from gsense_fusion.identification.verdict.growing_noise import growing_noise
from gsense_fusion.identification.verdict.high_orders import locked_band
from gsense_fusion.identification.verdict.lines import Line, equal_at_rest, pooled_lines, single_lines
from gsense_fusion.identification.verdict.motion_drift import motion_drift
from gsense_fusion.identification.verdict.residual import HALF_ORDERS, WindowResidual, line_energies
from gsense_fusion.identification.verdict.uneven_noise import KINDS, Uneven, not_folded, uneven_noise, where_fast

FAMILY_ALPHA = 0.004
FAMILIES = 7
SLOW_SHARE = 0.1
"""Of a family's share, for tests of block means: how a bias itself warms up is not quite the drift that they allow."""


@dataclass(frozen=True)
class Symptom:
    """Something that the complete model does not explain."""

    kind: str
    """orders, kicks, lines, band, intensity, course or drift."""
    axes: tuple[str, ...]
    p_value: float
    rate_rms: float
    """Of the unexplained part in rad/s, averaged over the windows in motion and root-summed over axes."""
    frequencies: tuple[float, ...]
    """rad/s; empty for broadband and slow symptoms."""
    description: str


@dataclass(frozen=True)
class OrderEnergy:
    """Drive-locked energy of the residual."""

    order: FloatArray
    energy: FloatArray
    """Sum over windows, shape (orders, 3)."""
    calibrated: FloatArray
    """Chi-square with two degrees of freedom a window where there is only noise, shape (orders, 3)."""
    amplitude_squared: FloatArray
    """Mean over windows of the squared amplitude, (rad/s)^2, shape (orders, 3)."""
    windows: FloatArray
    """Windows that reach the order, shape (orders,)."""

    def locked(self) -> float:
        """Energy above what noise alone would have there."""
        degrees = 2.0 * self.windows[:, None] * (self.energy > 0)
        return float(np.sum(np.maximum(self.energy - degrees, 0.0)))


def order_energy(windows: Sequence[WindowResidual]) -> OrderEnergy:
    """Energy at the half-orders 1/2 to 10 of the drive, pooled over the moving windows."""
    energy = np.zeros((len(HALF_ORDERS), 3))
    calibrated = np.zeros_like(energy)
    square = np.zeros_like(energy)
    count = np.zeros(len(HALF_ORDERS))
    for residual in windows:
        w = residual.angular_frequency
        if w is None:
            continue
        f = HALF_ORDERS * w / (2 * np.pi)
        reached = np.flatnonzero((f >= residual.frequency[0]) & (f <= residual.frequency[-1]))
        for i, line in zip(reached, line_energies(residual, f[reached]), strict=True):
            energy[i] += line.energy
            calibrated[i] += line.calibrated
            square[i] += line.amplitude_squared
            count[i] += 1
    return OrderEnergy(HALF_ORDERS, energy, calibrated, square / np.maximum(count, 1)[:, None], count)


def find_symptoms(
    likelihood: Likelihood, fit: Fit, windows: Sequence[WindowResidual], level: float = 1.0
) -> list[Symptom]:
    """All families of tests; a list of what failed, most significant first.

    `level`: how many times the power at rest the noise in motion is known to have.
    """
    alpha = FAMILY_ALPHA / FAMILIES
    moving = [w for w in windows if w.window.moving]
    still = [w for w in windows if not w.window.moving]
    found: list[Symptom] = []
    if moving:
        found += _orders(likelihood, moving, alpha / 2) + _high_orders(moving, alpha / 2)
        found += _lines(moving, still, alpha)
        growing = growing_noise(likelihood, windows)
        if level == 1.0:  # what is known to grow is so within the runs: there its law was compared with others
            growing += where_fast(likelihood, fit, moving)
        found += _bands(moving, still, alpha / 2) + _uneven("band", growing, alpha / 4)
        uneven = uneven_noise(likelihood, fit, moving) + bursts(moving, still, not_folded(likelihood, fit))
        found += _uneven("uneven", uneven, alpha / KINDS)
    found += _intensity(likelihood, fit, SLOW_SHARE * alpha, level)
    found += _courses(likelihood, fit, SLOW_SHARE * alpha)
    found += _drift(likelihood, fit, alpha)
    return sorted(found, key=lambda s: s.p_value)


def _names(mask: BoolArray) -> tuple[str, ...]:
    return tuple(AXES[i] for i in range(3) if mask[i])


def _orders(likelihood: Likelihood, moving: Sequence[WindowResidual], alpha: float) -> list[Symptom]:
    orders = order_energy(moving)
    axes = list(likelihood.noise)
    degrees = 2.0 * orders.windows * len(axes)
    reached = degrees > 0
    p = np.ones(len(orders.order))
    p[reached] = chi2.sf(orders.calibrated[reached].sum(axis=1), degrees[reached])
    hits = np.flatnonzero(p < alpha / max(1, int(reached.sum())))
    if not len(hits):
        return []
    strongest = hits[np.argsort(-orders.energy[hits].sum(axis=1))]
    per_axis = chi2.sf(orders.calibrated[hits].sum(axis=0), 2.0 * orders.windows[hits].sum())
    rms = float(np.sqrt(np.sum(orders.amplitude_squared[hits]) / 2.0))
    fastest = max(w.angular_frequency or 0.0 for w in moving)
    text = ", ".join(f"{orders.order[i]:g}" for i in strongest[:5])
    frequencies = tuple(float(orders.order[i] * fastest) for i in strongest[:5])
    description = f"locked to the drive at order {text} (frequencies given for the fastest run)"
    return [Symptom("orders", _names(per_axis < 0.001), float(p.min()), rms, frequencies, description)]


def _high_orders(moving: Sequence[WindowResidual], alpha: float) -> list[Symptom]:
    """Many small orders above the tenth (a mode that every reversal excites): their power against that between them."""
    found = locked_band(moving)
    if found is None or found.p_value > alpha:
        return []
    text = f"locked to the drive at orders above {HALF_ORDERS[-1]:g}, {found.low_hz:g} to {found.high_hz:g} Hz"
    return [Symptom("kicks", (AXES[found.axis],), found.p_value, found.rate_rms, (), text)]


def _lines(moving: Sequence[WindowResidual], still: Sequence[WindowResidual], alpha: float) -> list[Symptom]:
    """Lines at a fixed frequency that rest does not show equally."""
    hits = _foreign_lines(moving, still, alpha)
    if not hits:
        return []
    hits.sort(key=lambda h: h.p_value)
    tones: list[float] = []
    for hit in hits:
        if all(abs(hit.frequency_hz - g) > 0.15 for g in tones):
            tones.append(hit.frequency_hz)
    strongest = [max((h.amplitude for h in hits if abs(h.frequency_hz - f) <= 0.15), default=0.0) for f in tones]
    rms = float(np.sqrt(np.sum(np.square(strongest)) / 2))
    text = ", ".join(f"{f:.2f}" for f in tones[:4])
    description = f"a line at {text} Hz in motion that is not there at rest and not locked to the drive"
    axes = _names(np.array([any(h.axis == a for h in hits) for a in range(3)]))
    return [Symptom("lines", axes, hits[0].p_value, rms, tuple(2 * np.pi * f for f in tones[:5]), description)]


def _foreign_lines(moving: Sequence[WindowResidual], still: Sequence[WindowResidual], alpha: float) -> list[Line]:
    """Strong ones in single windows, weak ones pooled over all; half of alpha each."""
    hits = single_lines(moving, alpha / 2, still) + pooled_lines(moving, alpha / 2, still)
    return [h for h in hits if not equal_at_rest(h, moving, still)]


def strongest_line(moving: Sequence[WindowResidual], still: Sequence[WindowResidual]) -> Line | None:
    """The most significant line of motion away from the drive's orders, at the level of its family."""
    return min(_foreign_lines(moving, still, FAMILY_ALPHA / FAMILIES), key=lambda h: h.p_value, default=None)


def _bands(moving: Sequence[WindowResidual], still: Sequence[WindowResidual], alpha: float) -> list[Symptom]:
    """Broadband power in motion against rest."""
    found = louder_band(moving, still)
    if found is None or norm.sf(found.z) > alpha / found.looks:
        return []
    axis, p = AXES[found.axis], float(min(1.0, found.looks * norm.sf(found.z)))
    text = f"more noise in motion than at rest between {found.low_hz:g} and {found.high_hz:g} Hz, most on {axis}"
    return [Symptom("band", (axis,), p, found.rate_rms, (), text)]


def _uneven(kind: str, found: Sequence[Uneven], alpha: float) -> list[Symptom]:
    """Noise that is not everywhere the same: in one run, at one place, for a while, where accelerated or fast."""
    sure = [x for x in found if x.p_value < alpha]
    return [Symptom(kind, (AXES[x.axis],), x.p_value, x.rate_rms, (), x.words) for x in sure]


def _intensity(likelihood: Likelihood, fit: Fit, alpha: float, level: float) -> list[Symptom]:
    """Does the mean rate depend on how hard the carriage is driven (rectification)?"""
    runs = likelihood.campaign.fit
    if not any(r.motion is not None and r.motion.moving is not None for r in runs):
        return []
    columns, words = exertion(likelihood, fit)
    if np.ptp(columns[:, 0]) < 0.1:
        return []
    found = beside(likelihood, fit, columns)
    best = int(np.argmax(found.gains))
    gain = float(found.gains[best]) / level
    if found.hopeless(gain, len(likelihood.slow), alpha):
        return []
    p = found.p_value(gain)
    if p > alpha:
        return []
    ratio, slope = _sizes(likelihood, fit, columns[:, best])
    rms = float(np.linalg.norm(slope) * np.sqrt(np.mean(columns[:, best] ** 2)))
    text = f"the mean rate depends on {words[best]}"
    return [Symptom("intensity", _names(chi2.sf(ratio, 1) < 0.01), p, rms, (), text)]


def _courses(likelihood: Likelihood, fit: Fit, alpha: float) -> list[Symptom]:
    """A step or a course of the bias: does one make the session likelier although drift is free to take it up?"""
    tried = courses(likelihood)
    if not tried.words:
        return []
    best, p = 0, 0.0
    for free in _taken_and_free(gravity_columns(likelihood, fit)):
        found = beside(likelihood, fit, tried.columns, free)
        best = int(np.argmax(found.gains))
        gain = float(found.gains[best])
        if found.hopeless(gain, len(likelihood.slow), alpha):
            return []
        p = max(p, found.p_value(gain))
        if p > alpha:
            return []
    _, slope = _sizes(likelihood, fit, tried.columns[:, best])
    size = np.abs(slope) * float(np.std(tried.columns[:, best]))
    text = f"{tried.words[best]}, most on {AXES[int(np.argmax(size))]}"
    return [Symptom("course", _names(size > 0.3 * size.max()), p, float(np.linalg.norm(size)), (), text)]


def _taken_and_free(columns: FloatArray) -> list[FloatArray | None]:
    """Both ways to look beside columns (b, j) that may be there: what is seen one way alone is no evidence."""
    return [None, columns] if columns.shape[1] else [None]


def _drift(likelihood: Likelihood, fit: Fit, alpha: float) -> list[Symptom]:
    """A bias that wanders in motion and not at rest."""
    found = motion_drift(likelihood, fit)
    if found is None or found.chance.hopeless(found.gain, 1, alpha):
        return []
    p = found.chance.p_value(found.gain)
    if p > alpha:
        return []
    text = "the bias wanders more in motion than the rest records predict"
    spread = found.q * float(np.sqrt(np.ptp(likelihood.blocks.time)))
    return [Symptom("drift", tuple(AXES[i] for i in likelihood.slow), p, spread, (), text)]


def _sizes(likelihood: Likelihood, fit: Fit, column: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gain in twice the log-likelihood and size in the column's unit, by axis, at the model's drift, each (3,)."""
    ratio, size = np.zeros(3), np.zeros(3)
    residual = slow_residual(likelihood, fit)
    for axis, slow in likelihood.slow.items():
        gain, found = step_gains(slow, column[:, None], residual[:, axis], fit.drift[axis])
        ratio[axis], size[axis] = gain[0], found[0]
    return ratio, size
