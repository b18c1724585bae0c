"""A tone at a fixed frequency that is not equally there at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsense_fusion.identification.effects.statistical import Explanation, Seen, StatisticalEffect
from gsense_fusion.identification.search.peak import peak
from gsense_fusion.identification.types import AXES, BoolArray, FloatArray, Owner, Parameter
from gsense_fusion.identification.verdict.residual import WindowResidual
from gsense_fusion.identification.verdict.sufficiency import strongest_line

EVERYWHERE = 0.7
"""Part of the windows in motion that must have the tone: a line of one run alone is something else."""
STEADY = 0.35
"""Scatter of its amplitude over the windows, as a part of it, on top of noise."""
BESIDE_BINS = 3.0
WELL_SEEN = 3.0
"""Times the usual standard error up to which a window says something of the size."""
GRID_POINTS = 41
REFINED_TO = 0.02
"""Of the way between two points of the grid: a strong tone's frequency is known to less."""


class LineTone(StatisticalEffect):
    """a sin(2 pi f t + phase), f the same in every run: the mains or its alias, a fan, a converter."""

    name = "line_tone"
    owner = Owner.CHAIN
    equation = "a sin(2 pi f t + phase)"
    source = "mains hum and switching converters seen through the sampler"
    symptom = "lines"

    def explain(self, seen: Seen) -> Explanation | None:
        """One frequency that all runs share, with the phase of each its own."""
        likelihood, windows = seen.likelihood, seen.windows
        moving = [w for w in windows if w.window.moving and w.data in likelihood.campaign.fit]
        found = strongest_line(moving, [w for w in windows if not w.window.moving])
        if found is None:
            return None
        frequency = _refined(moving, found.frequency_hz)
        usable = [w for w in moving if _near(w, frequency).any() and not w.gone_with_an_order(frequency)]
        fits = _well_seen([_sine(w, frequency) for w in usable])
        if not fits:
            return None
        axis = int(np.argmax(np.median([np.abs(f.coefficient) for f in fits], axis=0)))
        amplitude, noise = np.array([f.all_axes() for f in fits]).T
        level = float(np.median(amplitude))
        present = np.mean(amplitude > 0.5 * level + noise)
        scatter = float(np.sqrt(max(np.var(amplitude) - np.mean(noise**2), 0.0)))
        if present < EVERYWHERE or scatter > STEADY * level:
            return None
        size, error = _sizes(fits, axis)
        parameters = {f"a_{x}": Parameter(float(size[i]), float(error[i]), "rad/s") for i, x in enumerate(AXES)}
        resolution = float(np.min([w.resolution_hz for w in usable]))
        spread = resolution * float(error[axis]) / max(float(size[axis]), 1e-30)
        parameters["frequency"] = Parameter(frequency, max(spread, 1e-6), "Hz")
        seen_first = fits[0].coefficient[axis]
        uncertain = float(fits[0].stderr[axis] / max(abs(seen_first), 1e-30))
        parameters["phase"] = Parameter(float(np.angle(seen_first)), uncertain, "rad")
        axes = tuple(x for i, x in enumerate(AXES) if abs(size[i]) > 3 * error[i])
        rest = tuple(_without(w, frequency) for w in windows)
        return Explanation(parameters, axes, found.p_value, rest, float(np.linalg.norm(size) / np.sqrt(2)))


def _well_seen(fits: Sequence[_Sine]) -> list[_Sine]:
    """Those not much less certain than the others: beside one of the drive's orders little of a line is seen."""
    usual = np.median([f.stderr for f in fits], axis=0) if fits else np.zeros(3)
    return [f for f in fits if np.all(f.stderr <= WELL_SEEN * usual)]


class _Sine:
    def __init__(self, coefficient: FloatArray, stderr: FloatArray) -> None:
        self.coefficient = coefficient
        self.stderr = stderr

    def all_axes(self) -> tuple[float, float]:
        """Amplitude over all axes without what noise adds, and its standard error: of one axis a weak tone scatters."""
        there = np.isfinite(self.stderr)
        square = float(np.sum(np.abs(self.coefficient[there]) ** 2 - 2 * self.stderr[there] ** 2))
        return max(square, 0.0) ** 0.5, float(np.sqrt(np.mean(self.stderr[there] ** 2)))


def _near(residual: WindowResidual, frequency: float) -> BoolArray:
    return _around(residual, frequency) & residual.away_from_orders()


def _around(residual: WindowResidual, frequency: float) -> BoolArray:
    return np.asarray(np.abs(residual.frequency - frequency) < BESIDE_BINS * residual.resolution_hz)


def _sizes(fits: Sequence[_Sine], axis: int) -> tuple[FloatArray, FloatArray]:
    """Amplitudes in the phase of the strongest axis, whatever that is in each window, and their errors, (3,) each.

    A weak axis shows by its product with the strongest one: noise, which its own square is mostly made of, is another
    on each axis.
    """
    c = np.array([f.coefficient for f in fits])
    variance = np.mean([f.stderr**2 for f in fits], axis=0)
    square = np.mean((c * c[:, [axis]].conj()).real, axis=0)
    square[axis] -= 2 * variance[axis]
    strongest = max(float(square[axis]), float(variance[axis]) / len(fits))
    error = np.sqrt(variance * (1.0 + 2.0 * variance[axis] / strongest) / len(fits))
    return square / np.sqrt(strongest), error


def _sine(residual: WindowResidual, frequency: float, near: BoolArray | None = None) -> _Sine:
    """Complex amplitude of a sine in a window, rad/s, by axis, from the bins `near` (around it, away from orders)."""
    n, rate = len(residual.window), residual.data.run.rate_hz
    t = residual.data.run.time[residual.window.start] + np.arange(n) / rate
    tone = np.fft.fft(np.exp(2j * np.pi * frequency * t))[: n // 2 + 1][residual.bins.keep]
    if near is None:
        near = _near(residual, frequency)
    values = (residual.spectrum[0] + 1j * residual.spectrum[1])[near]
    coefficient, stderr = np.zeros(3, dtype=complex), np.full(3, np.inf)
    for axis in range(3):
        x = tone[near] * residual.bins.weight[near, axis] / 2
        xx = float(np.sum(np.abs(x) ** 2))
        if xx > 0:
            coefficient[axis] = np.sum(np.conj(x) * values[:, axis]) / xx
            stderr[axis] = 1.0 / np.sqrt(xx)
    return _Sine(coefficient, stderr)


def _refined(moving: Sequence[WindowResidual], frequency: float) -> float:
    """The frequency at which all windows together hold most energy."""
    step = min(w.resolution_hz for w in moving)
    grid = frequency + step * np.linspace(-2.0, 2.0, GRID_POINTS)

    def energy(f: float) -> float:
        return sum(float(np.sum((np.abs(s.coefficient) / s.stderr) ** 2)) for s in (_sine(w, f) for w in moving))

    apart = float(grid[1] - grid[0])
    centre = float(grid[int(np.argmax([energy(float(f)) for f in grid]))])
    return peak(energy, centre, centre - apart, centre + apart, REFINED_TO * apart)


def _without(residual: WindowResidual, frequency: float) -> WindowResidual:
    """The residual without the sine that fits it best; at rest it is left as it is.

    In a run where it falls on a half-order of the drive it is taken out there too, else it would look locked to it.
    """
    if not residual.window.moving:
        return residual
    if residual.gone_with_an_order(frequency):  # of what little is left beside it no sine can be told
        return replace(residual, spectrum=residual.spectrum * ~_around(residual, frequency)[:, None])
    n, rate = len(residual.window), residual.data.run.rate_hz
    t = residual.data.run.time[residual.window.start] + np.arange(n) / rate
    sine = _sine(residual, frequency, _around(residual, frequency))
    tone = np.fft.fft(np.exp(2j * np.pi * frequency * t))[: n // 2 + 1][residual.bins.keep] / 2
    gone = tone[:, None] * sine.coefficient * residual.bins.weight
    return replace(residual, spectrum=residual.spectrum - np.stack([gone.real, gone.imag]))
