"""The carriage's motion from the encoder: position, velocity, acceleration and jerk without the encoder's noise.

Differentiating quantised counts three times is hopeless, and regressing on a noisy driver attenuates its coefficient.
In the steady part of a run the position is therefore projected on harmonics of the drive and differentiated
analytically; elsewhere (ramps, other shapes) a band-limited derivative has to do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from gsense_fusion.identification.types import BoolArray, FloatArray

STILL_SPAN_S = 0.5
STILL_RANGE_M = 2e-4
"""A carriage that stays within 4 counts of the encoder for half a second stands still."""
HIGHEST_HARMONIC_HZ = 20.0
MAX_HARMONICS = 40
KEEP_SIGMA = 5.0
LOCKED_PART = 0.2
"""Of the deviation that rounding to counts makes: what stays in each order, as it repeats with the drive."""
MIN_PERIODS = 2.5
MARGINS = (0.2, 0.3, 0.38)
"""Parts of the motion left out at both ends where its middle is fitted."""
SILENT_S = 0.1
"""An encoder that says nothing for so long: harmonics go on through it, a line does not."""


@dataclass(frozen=True)
class Kinematics:
    """Motion along the rail at given times, each of shape (n,)."""

    position: FloatArray
    """m."""
    velocity: FloatArray
    """m/s."""
    acceleration: FloatArray
    """m/s^2."""
    jerk: FloatArray
    """m/s^3."""

    @staticmethod
    def at_rest(position: float, n: int) -> Kinematics:
        """A carriage that stands at `position`."""
        zero = np.zeros(n)
        return Kinematics(np.full(n, position), zero, zero, zero)


@dataclass(frozen=True)
class Harmonics:
    """s(t) = offset + sum_h c_h cos(h w t) + d_h sin(h w t), t from `origin`."""

    angular_frequency: float
    origin: float
    offset: float
    orders: FloatArray
    cosine: FloatArray
    sine: FloatArray
    residual_rms: float
    stderr: float = 0.0
    """Of each amplitude, m: counts are rounded alike in every period, which no averaging takes out."""

    @property
    def amplitude(self) -> float:
        """Amplitude of the fundamental in m."""
        first = self.orders == 1
        return float(np.hypot(self.cosine[first].sum(), self.sine[first].sum()))

    def lowest(self, order: int) -> Harmonics:
        """The same without orders above one."""
        keep = self.orders <= order
        return replace(self, orders=self.orders[keep], cosine=self.cosine[keep], sine=self.sine[keep])

    def at(self, time: FloatArray) -> Kinematics:
        """Position and its analytic derivatives at the times (n,)."""
        w = self.angular_frequency * self.orders
        phase = np.outer(time - self.origin, w)
        c, s = np.cos(phase), np.sin(phase)
        return Kinematics(
            position=self.offset + c @ self.cosine + s @ self.sine,
            velocity=c @ (self.sine * w) - s @ (self.cosine * w),
            acceleration=-(c @ (self.cosine * w**2) + s @ (self.sine * w**2)),
            jerk=-(c @ (self.sine * w**3)) + s @ (self.cosine * w**3),
        )


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
        steps = np.diff(time)
        silent = np.flatnonzero(steps > max(SILENT_S, 3 * float(np.median(steps))))
        self.silent: tuple[Interval, ...] = tuple(Interval(float(time[i]), float(time[i + 1])) for i in silent)
        moving = ~still_mask(self._time, self._position)
        for gap in self.silent:  # a flat line through a motion is no rest
            low, high = np.searchsorted(self._time, (gap.start, gap.stop))
            moving[low:high] |= moving[max(low - 1, 0)] | moving[min(high, len(moving) - 1)]
        self.still: tuple[Interval, ...] = _intervals(self._time, ~moving)
        stretches = _intervals(self._time, moving)
        self.moving: Interval | None = max(stretches, key=lambda i: i.duration, default=None)
        self.harmonics: Harmonics | None = None
        self.steady: Interval | None = None
        self.felt: Harmonics | None = None
        """What the accelerometer adds to the steady part's acceleration and jerk (`felt_harmonics`)."""
        self.ringing: Harmonics | None = None
        """The same above `HIGHEST_HARMONIC_HZ`: it is felt, but no rigid carriage moves so."""
        if self.moving is not None:
            found = _steady_sine(self._time, self._position, self.moving, self._heard())
            if found is not None:
                self.harmonics, self.steady = found
        self._smooth = None if self.moving is None else _BandLimited(self._time, self._position, self._cutoff_hz())

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
    def angular_frequency(self) -> float | None:
        """Of the drive in rad/s; None where it is not periodic or does not move."""
        return None if self.harmonics is None else self.harmonics.angular_frequency

    @property
    def amplitude(self) -> float | None:
        """Of the fundamental in m."""
        return None if self.harmonics is None else self.harmonics.amplitude

    def at(self, time: FloatArray) -> Kinematics:
        """Motion at the times (n,) in s: harmonic in the steady part, else band-limited, at rest beyond the record."""
        if self._smooth is None:
            return Kinematics.at_rest(float(np.median(self._position)), len(time))
        smooth = self._smooth.at(time)
        if self.harmonics is None or self.steady is None:
            return smooth
        inside = (time >= self.steady.start) & (time <= self.steady.stop)
        exact = self.harmonics.at(time[inside])
        for name in ("position", "velocity", "acceleration", "jerk"):
            getattr(smooth, name)[inside] = getattr(exact, name)
        if self.felt is not None:
            felt = self.felt.at(time[inside])
            smooth.acceleration[inside] += felt.acceleration
            smooth.jerk[inside] += felt.jerk
        return smooth

    def ringing_at(self, time: FloatArray) -> FloatArray:
        """Acceleration along the rail that the sensor feels on top of `at` at the times (n,), m/s^2."""
        out = np.zeros(len(time))
        if self.ringing is not None and self.steady is not None:
            inside = (time >= self.steady.start) & (time <= self.steady.stop)
            out[inside] = self.ringing.at(time[inside]).acceleration
        return out


def still_mask(time: FloatArray, position: FloatArray) -> BoolArray:
    """Where the carriage stands still: its range over half a second is a few encoder counts, shape (m,)."""
    span = max(3, round(STILL_SPAN_S / float(np.median(np.diff(time)))) | 1)
    reach = maximum_filter1d(position, span) - minimum_filter1d(position, span)
    return np.asarray(reach < STILL_RANGE_M)


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
    period = 2 * np.pi / guess
    if period * MIN_PERIODS > moving.duration or period > float(np.ptp(t[middle])):
        return None
    used = middle & heard
    if used.sum() < 50:
        return None
    fit = fit_harmonics(t[used], s[used], guess)
    quantum = _quantum(s)
    tolerance = 6 * max(fit.residual_rms, quantum)
    if fit.amplitude < 20 * quantum or fit.residual_rms > 2e-3 * fit.amplitude + quantum:
        return None
    error = np.where(heard, np.abs(s - fit.at(t).position), 0.0)
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


def fit_harmonics(time: FloatArray, position: FloatArray, guess: float) -> Harmonics:
    """Least squares of the drive's harmonics with its frequency; harmonics under 5 sigma are dropped.

    Args:
        time: s, shape (n,).
        position: m, shape (n,).
        guess: Angular frequency in rad/s, within about 1/duration of the truth.

    """
    origin = float(time.mean())
    t = time - origin
    w = guess
    for _ in range(8):
        X = _columns(t, w, np.arange(1.0, 4.0))
        beta = _solve(X, position)
        slope = X[:, 4:7] @ (beta[1:4] * np.arange(1, 4)) * -1.0 + X[:, 1:4] @ (beta[4:7] * np.arange(1, 4))
        both = _solve(np.column_stack([X, t * slope]), position)
        w += float(both[-1])
        if abs(both[-1]) < 1e-9 * w:
            break
    rate = 1.0 / float(np.median(np.diff(time)))
    highest = min(MAX_HARMONICS, int(min(HIGHEST_HARMONIC_HZ, 0.4 * rate) * 2 * np.pi / w), len(t) // 8)
    orders = np.arange(1.0, max(2, highest + 1))
    return _keep_significant(t, position, w, orders, origin)


def _keep_significant(t: FloatArray, position: FloatArray, w: float, orders: FloatArray, origin: float) -> Harmonics:
    for _ in range(2):
        X = _columns(t, w, orders)
        beta = _solve(X, position)
        rms = float(np.std(position - X @ beta))
        k = len(orders)
        size = np.hypot(beta[1 : 1 + k], beta[1 + k :])
        keep = size > KEEP_SIGMA * rms * np.sqrt(2.0 / len(t))
        keep[0] = True
        if keep.all():
            break
        orders = orders[keep]
    X = _columns(t, w, orders)
    beta = _solve(X, position)
    k = len(orders)
    rms = float(np.std(position - X @ beta))
    stderr = max(rms * float(np.sqrt(2.0 / len(t))), LOCKED_PART * rms)
    return Harmonics(w, origin, float(beta[0]), orders, beta[1 : 1 + k], beta[1 + k :], rms, stderr)


def _solve(X: FloatArray, y: FloatArray) -> FloatArray:
    """Least squares by the normal equations: harmonics over whole periods are nearly orthogonal, and this is fast."""
    scale = np.sqrt(np.sum(X**2, axis=0))
    unit = X / scale
    return np.asarray(np.linalg.solve(unit.T @ unit, unit.T @ y) / scale)


def _columns(t: FloatArray, w: float, orders: FloatArray) -> FloatArray:
    phase = np.outer(t, w * orders)
    return np.column_stack([np.ones(len(t)), np.cos(phase), np.sin(phase)])


class _BandLimited:
    """Derivatives of the whole record by a low-pass in the frequency domain, ends continued by odd reflection."""

    def __init__(self, time: FloatArray, position: FloatArray, cutoff_hz: float) -> None:
        n = len(time)
        pad = min(n - 1, round(4.0 / (time[1] - time[0])))
        left = 2 * position[0] - position[pad:0:-1]
        right = 2 * position[-1] - position[-2 : -pad - 2 : -1]
        extended = np.concatenate([left, position, right])
        trend = np.linspace(extended[0], extended[-1], len(extended))
        step = float(time[1] - time[0])
        w = 2 * np.pi * np.fft.rfftfreq(len(extended), step)
        roll = np.clip((1.5 * cutoff_hz - w / (2 * np.pi)) / (0.5 * cutoff_hz), 0.0, 1.0)
        spectrum = np.fft.rfft(extended - trend) * 0.5 * (1 - np.cos(np.pi * roll))
        slope = (trend[1] - trend[0]) / step
        offsets = (trend, slope, 0.0, 0.0)
        parts = [np.fft.irfft(spectrum * (1j * w) ** k, len(extended)) + offsets[k] for k in range(4)]
        self._start, self._stop = float(time[0]), float(time[-1])
        self._splines = [CubicSpline(time, part[pad : pad + n]) for part in parts]

    def at(self, time: FloatArray) -> Kinematics:
        """Motion at the times; beyond the record the carriage is taken to stay where it was."""
        clipped = np.clip(time, self._start, self._stop)
        position, velocity, acceleration, jerk = (np.asarray(spline(clipped)) for spline in self._splines)
        outside = (time < self._start) | (time > self._stop)
        for series in (velocity, acceleration, jerk):
            series[outside] = 0.0
        return Kinematics(position, velocity, acceleration, jerk)
