"""The carriage's motion from the encoder: position, velocity, acceleration and jerk without the encoder's noise.

Differentiating quantised counts three times is hopeless, and regressing on a noisy driver attenuates its coefficient.
In the steady part of a run the position is therefore projected on harmonics of the drive and differentiated
analytically; elsewhere (ramps, other shapes) a band-limited derivative has to do.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from gsense_fusion.identification.motion.band_limited import BandLimited
from gsense_fusion.identification.motion.harmonics import Harmonics, Kinematics, fit_harmonics, refined_guess
from gsense_fusion.identification.motion.readings import lasting_rms, smoothed
from gsense_fusion.identification.motion.splined import Splined
from gsense_fusion.identification.types import BoolArray, FloatArray

STILL_SPAN_S = 0.5
STILL_RANGE_M = 2e-4
"""A carriage that stays within 4 counts of the encoder for half a second stands still."""
MIN_PERIODS = 2.5
MARGINS = (0.2, 0.3, 0.38)
"""Parts of the motion left out at both ends where its middle is fitted."""
BEND_S = 0.5
"""How far the bend at an encoder's gap is felt in a motion that is no steady sine."""
MIN_REST_S = 2.5
"""A shorter rest is a dwell at a turning point."""
SLOW_HZ = 2.0
"""Position noise of 1 mm makes 3 m/s^2 in a band of 12 Hz, and 0.03 in this one."""
SILENT_S = 0.1
"""An encoder that says nothing for so long: harmonics go on through it, a line does not."""


@dataclass(frozen=True)
class Interval:
    """A stretch of time in s."""

    start: float
    stop: float

    @property
    def duration(self) -> float:
        """Length in s."""
        return self.stop - self.start


class CarriageMotion:
    """What the encoder of one run says about the motion."""

    def __init__(self, time: FloatArray, position: FloatArray) -> None:
        """Analyse the encoder's record.

        Args:
            time: Stamps in s, shape (m,), increasing.
            position: Carriage position in m, shape (m,).

        """
        self._time, self._position = _uniform(time, position)
        self.silent = _silent(time)
        moving = _moving_mask(self._time, self._position, self.silent)
        self.still: tuple[Interval, ...] = _intervals(self._time, ~moving)
        stretches = _intervals(self._time, moving)
        self.moving: Interval | None = max(stretches, key=lambda i: i.duration, default=None)
        self.harmonics: Harmonics | None = None
        self.steady: Interval | None = None
        self.felt: Harmonics | None = None
        """What the accelerometer adds to the steady part's acceleration and jerk (`felt_harmonics`)."""
        self.ringing: Harmonics | None = None
        """The same above `HIGHEST_HARMONIC_HZ`: it is felt, but no rigid carriage moves so."""
        self.folded: Harmonics | None = None
        """The same above half the sample rate."""
        if self.moving is not None:
            found = _steady_sine(self._time, self._position, self.moving, self._heard())
            if found is not None:
                self.harmonics, self.steady = found
            else:
                self.moving = max(without_dwells(stretches), key=lambda i: i.duration)
                self.still = tuple(i for i in self.still if not self.moving.start < i.start < self.moving.stop)
        self.beyond: Splined | None = None
        """What the accelerometer adds to a motion that is no steady sine (`felt_motion`)."""
        self.smooth = None if self.moving is None else BandLimited(self._time, self._position, self._cutoff_hz())
        """The whole record, band-limited; None where nothing moves."""

    def _heard(self) -> BoolArray:
        """Where the record has readings, shape (m,)."""
        heard = np.ones(len(self._time), dtype=bool)
        for gap in self.silent:
            heard &= (self._time <= gap.start) | (self._time >= gap.stop)
        return heard

    def _cutoff_hz(self) -> float:
        if self.harmonics is None:
            return 12.0
        return float(np.clip(self.harmonics.angular_frequency / (2 * np.pi) * 12.0, 1.0, 12.0))

    @property
    def covered(self) -> Interval:
        """From the first reading to the last."""
        return Interval(float(self._time[0]), float(self._time[-1]))

    @property
    def angular_frequency(self) -> float | None:
        """Of the drive in rad/s; None where it is not periodic or does not move."""
        return None if self.harmonics is None else self.harmonics.angular_frequency

    @property
    def amplitude(self) -> float | None:
        """Of the fundamental in m."""
        return None if self.harmonics is None else self.harmonics.amplitude

    def heard_at(self, time: FloatArray) -> BoolArray:
        """Whether the encoder was not silent for long at the times (n,) in s.

        The bend of a line into a gap is an acceleration that the band limit spreads to both sides.
        """
        heard = np.ones(len(time), dtype=bool)
        for gap in self.silent:
            heard &= (time < gap.start - BEND_S) | (time > gap.stop + BEND_S)
        return heard

    def slowly(self) -> CarriageMotion:
        """The motion with what an encoder of much noise still knows of its acceleration."""
        out = copy.copy(self)
        out.smooth = BandLimited(self._time, self._position, SLOW_HZ)
        return out

    def at(self, time: FloatArray) -> Kinematics:
        """Motion at the times (n,) in s: harmonic in the steady part, else band-limited, at rest beyond the record."""
        if self.smooth is None:
            return Kinematics.at_rest(float(np.median(self._position)), len(time))
        if self.harmonics is None or self.steady is None:
            smooth = self.smooth.at(time)
            return smooth if self.beyond is None else self.beyond.added_to(smooth, time)
        inside = (time >= self.steady.start) & (time <= self.steady.stop)
        smooth, exact = self.smooth.at(time[~inside]), self.harmonics.at(time[inside])
        if self.felt is not None:
            felt = self.felt.at(time[inside])
            exact = replace(exact, acceleration=exact.acceleration + felt.acceleration, jerk=exact.jerk + felt.jerk)
        series = np.empty((4, len(time)))
        for i, name in enumerate(("position", "velocity", "acceleration", "jerk")):
            series[i, inside], series[i, ~inside] = getattr(exact, name), getattr(smooth, name)
        return Kinematics(*series)

    def ringing_at(self, time: FloatArray) -> FloatArray:
        """What the sensor feels along the rail on top of `at`, at the times (n,).

        Returns:
            Acceleration and jerk below half the sample rate, and the acceleration above it, shape (3, n).

        """
        out = np.zeros((3, len(time)))
        if self.ringing is not None and self.folded is not None and self.steady is not None:
            inside = (time >= self.steady.start) & (time <= self.steady.stop)
            felt = self.ringing.at(time[inside])
            folded = self.folded.at(time[inside])
            out[:, inside] = felt.acceleration, felt.jerk, folded.acceleration
        return out


def still_mask(time: FloatArray, position: FloatArray) -> BoolArray:
    """Where the carriage stands still: its range over half a second is a few encoder counts, shape (m,)."""
    span = max(3, round(STILL_SPAN_S / float(np.median(np.diff(time)))) | 1)
    reach = maximum_filter1d(position, span) - minimum_filter1d(position, span)
    return np.asarray(reach < STILL_RANGE_M)


def moving_stretches(time: FloatArray, position: FloatArray) -> tuple[Interval, ...]:
    """When the carriage moves, in the time of the encoder's record: stamps in s and positions in m, shape (m,)."""
    grid, uniform = _uniform(time, position)
    return _intervals(grid, _moving_mask(grid, uniform, _silent(time)))


def without_dwells(stretches: Sequence[Interval]) -> list[Interval]:
    """Stretches of motion with less than a rest between them, joined."""
    joined: list[Interval] = []
    for stretch in stretches:
        goes_on = bool(joined) and stretch.start - joined[-1].stop < MIN_REST_S
        joined.append(Interval(joined.pop().start, stretch.stop) if goes_on else stretch)
    return joined


def _moving_mask(time: FloatArray, position: FloatArray, silent: tuple[Interval, ...]) -> BoolArray:
    moving = ~still_mask(time, position)
    for gap in silent:  # a flat line through a motion is no rest
        low, high = np.searchsorted(time, (gap.start, gap.stop))
        moving[low:high] |= moving[max(low - 1, 0)] | moving[min(high, len(moving) - 1)]
    return moving


def _silent(time: FloatArray) -> tuple[Interval, ...]:
    steps = np.diff(time)
    silent = np.flatnonzero(steps > max(SILENT_S, 3 * float(np.median(steps))))
    return tuple(Interval(float(time[i]), float(time[i + 1])) for i in silent)


def _uniform(time: FloatArray, position: FloatArray) -> tuple[FloatArray, FloatArray]:
    step = float(np.median(np.diff(time)))
    grid = np.arange(time[0], time[-1] + step / 2, step)
    return grid, np.interp(grid, time, position)


def _intervals(time: FloatArray, mask: BoolArray) -> tuple[Interval, ...]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return tuple(Interval(float(time[a]), float(time[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True))


def _steady_sine(
    time: FloatArray, position: FloatArray, moving: Interval, heard: BoolArray
) -> tuple[Harmonics, Interval] | None:
    """The harmonic model of the middle of the motion, and how far to both sides it holds."""
    for margin in MARGINS:  # a short run has ramps far into its middle
        found = _sine_of_middle(time, position, moving, heard, margin)
        if found is not None:
            return found
    return None


def _sine_of_middle(
    time: FloatArray, position: FloatArray, moving: Interval, heard: BoolArray, margin: float
) -> tuple[Harmonics, Interval] | None:
    inside = (time >= moving.start) & (time <= moving.stop)
    t, s, heard = time[inside], position[inside], heard[inside]
    middle = (t > moving.start + margin * moving.duration) & (t < moving.stop - margin * moving.duration)
    if middle.sum() < 50:
        return None
    guess = _dominant_angular_frequency(t[middle], s[middle])
    if not heard[middle].all():
        guess = refined_guess(t[middle & heard], s[middle & heard], guess)
    period = 2 * np.pi / guess
    if period * MIN_PERIODS > moving.duration or period > float(np.ptp(t[middle])):
        return None
    used = middle & heard
    if used.sum() < 50:
        return None
    fit = fit_harmonics(t[used], s[used], guess)
    quantum, readings = _quantum(s[heard]), period / float(t[1] - t[0])
    rest = np.where(heard, s - fit.position_at(t), 0.0)
    allowed, most = 2e-3 * fit.amplitude + quantum, 6.0
    jittering = fit.residual_rms > allowed
    if fit.amplitude < 20 * quantum or (jittering and lasting_rms(rest[used], readings) > allowed):
        return None
    if jittering:
        rest, most = smoothed(rest, readings), 6.0 * np.sqrt(2.0)  # a stamp's error is largest at the highest speed
    tolerance = most * max(float(np.std(rest[used])), quantum)
    error = np.where(heard, np.abs(rest), 0.0)
    worst = maximum_filter1d(error, max(3, round(0.25 * period / float(t[1] - t[0])) | 1))
    centre = len(t) // 2
    bad = np.flatnonzero(worst > tolerance)
    low = int(bad[bad < centre].max()) + 1 if (bad < centre).any() else 0
    high = int(bad[bad >= centre].min()) if (bad >= centre).any() else len(t)
    if high - low < 50 or t[high - 1] - t[low] < MIN_PERIODS * period:
        return None
    known = np.arange(low, high)[heard[low:high]]
    return fit_harmonics(t[known], s[known], fit.angular_frequency), Interval(float(t[low]), float(t[high - 1]))


def _quantum(position: FloatArray) -> float:
    steps = np.abs(np.diff(position))
    steps = steps[steps > 1e-9]
    return float(np.min(steps)) if len(steps) else 1e-6


def _dominant_angular_frequency(time: FloatArray, position: FloatArray) -> float:
    n = 16 * len(time)
    spectrum = np.abs(np.fft.rfft((position - position.mean()) * np.hanning(len(time)), n))
    frequency = np.fft.rfftfreq(n, float(time[1] - time[0]))
    return float(2 * np.pi * frequency[int(np.argmax(spectrum[1:])) + 1])
