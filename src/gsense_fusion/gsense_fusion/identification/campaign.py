"""The runs of a campaign with their motion, mounting and delay: what every later step works on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import prev_fast_len
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from gsense_fusion.identification.effects.base import Drivers, Templates
from gsense_fusion.identification.effects.design import RailForce
from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.felt_harmonics import with_felt_orders
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.motion.mounting import (
    NOMINAL,
    Delay,
    Mounting,
    RunGeometry,
    common_delay,
    find_mountings,
    run_delays,
    run_geometry,
)
from gsense_fusion.identification.motion.turned_delays import without_turns
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import BoolArray, FloatArray, Role

TEMPERATURE_REFERENCE = 25.0
"""T0 of temperature_bias in degrees Celsius."""
EDGE_S = 0.15
"""Trimmed from windows at both ends: filters ring after a change of motion."""
MIN_STILL_S = 1.0
FAST_LENGTH_FROM = 500
MIN_MOVING_S = 4.0
LONG_GAP_S = 0.1
"""A line through a gap of this length leaves 8 % of what 8 rad/s did within it; longer ones end a window."""


@dataclass(frozen=True)
class Window:
    """Samples start to stop (exclusive) of a run; `moving` in steady motion, else at rest."""

    start: int
    stop: int
    moving: bool

    def __len__(self) -> int:
        return self.stop - self.start


@dataclass(frozen=True, eq=False)
class RunData:
    """One run with what was found about its motion."""

    run: CleanRun
    motion: CarriageMotion | None
    geometry: RunGeometry
    mounting: Mounting | None
    mounting_number: int | None
    windows: tuple[Window, ...]
    delay_s: float
    """How much later than the encoder's the IMU's samples of this run are, s."""

    @property
    def is_fit(self) -> bool:
        """Whether the run may be fitted."""
        return self.run.role is Role.FIT


@dataclass(frozen=True, eq=False)
class Campaign:
    """All runs of one sensor."""

    runs: tuple[RunData, ...]
    mountings: tuple[Mounting, ...]
    delay: Delay
    """Of the IMU against the encoder."""

    @property
    def fit(self) -> tuple[RunData, ...]:
        """The runs to fit."""
        return tuple(r for r in self.runs if r.is_fit)

    @property
    def held_out(self) -> tuple[RunData, ...]:
        """The runs to judge by."""
        return tuple(r for r in self.runs if not r.is_fit)

    @property
    def rate_hz(self) -> float:
        """The sample rate that most runs have."""
        return float(np.median([r.run.rate_hz for r in self.runs]))

    @property
    def axes(self) -> tuple[int, ...]:
        """Gyro axes that all runs have."""
        return tuple(i for i in range(3) if all(i in r.run.axes for r in self.runs))


def build_campaign(runs: Sequence[CleanRun]) -> Campaign:
    """Find motion, mountings and the encoder's delay."""
    motions = [None if r.pose is None or r.pose_time is None else CarriageMotion(r.pose_time, r.pose) for r in runs]
    geometry = [run_geometry(r, m) for r, m in zip(runs, motions, strict=True)]
    geometry = without_turns(geometry, [None if m is None else m.angular_frequency for m in motions])
    with_rig = [i for i, m in enumerate(motions) if m is not None]
    mountings, member = find_mountings([geometry[i] for i in with_rig])
    number = dict(zip(with_rig, member, strict=True))
    delay = common_delay(geometry)
    delays = run_delays(geometry, delay)
    data = []
    for i, (run, motion, found, late) in enumerate(zip(runs, motions, geometry, delays, strict=True)):
        if i in number:
            k = number[i]
            mounting = NOMINAL if k is None else mountings[k]
        else:  # a still pose held by nothing but the table: a mounting of its own
            mountings.append(_pose(found))
            k, mounting = len(mountings) - 1, mountings[-1]
        moved = with_felt_orders(motion, run, found.along, late)
        data.append(RunData(run, moved, found, mounting, k, _windows(run, motion, late), late))
    return Campaign(tuple(data), tuple(mountings), delay)


def _pose(geometry: RunGeometry) -> Mounting:
    norm = float(np.linalg.norm(geometry.mean_force))
    return Mounting(geometry.mean_force / norm, None, norm)


def _windows(run: CleanRun, motion: CarriageMotion | None, delay: float) -> tuple[Window, ...]:
    """Steady motion (whole where it is not periodic) and rest, in the IMU's time."""
    if motion is None:
        return (Window(0, len(run), False),)
    whole = _whole_windows(run, motion, delay)
    known = run.valid if motion.harmonics is not None else run.valid & _heard(run, motion, delay)
    return tuple(part for w in whole for part in _between_gaps(known, run.rate_hz, w))


def _heard(run: CleanRun, motion: CarriageMotion, delay: float) -> BoolArray:
    """Samples at which the encoder was not silent for long, shape (n,)."""
    heard = np.ones(len(run), dtype=bool)
    for gap in motion.silent:
        heard &= (run.time < gap.start + delay) | (run.time > gap.stop + delay)
    return heard


def _whole_windows(run: CleanRun, motion: CarriageMotion, delay: float) -> tuple[Window, ...]:
    out = []
    steady = motion.steady if motion.steady is not None else motion.moving
    if steady is not None and steady.duration >= MIN_MOVING_S:
        out.append(_cut(run, steady.start + delay, steady.stop + delay, True))
    covered = [i for i in motion.still if i.duration >= MIN_STILL_S + 2 * EDGE_S]
    out.extend(_cut(run, i.start + delay, i.stop + delay, False) for i in covered)
    return tuple(w for w in out if len(w) >= round(0.8 * MIN_STILL_S * run.rate_hz))


def _between_gaps(known: BoolArray, rate_hz: float, window: Window) -> tuple[Window, ...]:
    """The window without its long gaps: a line drawn through one is not the rate that was there."""
    lost = np.diff(np.concatenate([[0], (~known[window.start : window.stop]).astype(np.int8), [0]]))
    edges = zip(np.flatnonzero(lost == 1), np.flatnonzero(lost == -1), strict=True)
    gaps = [(int(a), int(b)) for a, b in edges if b - a > LONG_GAP_S * rate_hz]
    if not gaps:
        return (window,)
    starts = [0, *(b for _, b in gaps)]
    stops = [*(a for a, _ in gaps), len(window)]
    shortest = (MIN_MOVING_S if window.moving else 0.8 * MIN_STILL_S) * rate_hz
    parts = [(a, b) for a, b in zip(starts, stops, strict=True) if b - a >= shortest]
    return tuple(Window(window.start + a, window.start + _fast(b - a) + a, window.moving) for a, b in parts)


def _fast(length: int) -> int:
    """A length that the FFT likes loses a few samples and wins a lot of time."""
    return int(prev_fast_len(length, real=True)) if length > FAST_LENGTH_FROM else length


def _cut(run: CleanRun, start: float, stop: float, moving: bool) -> Window:
    low = int(np.searchsorted(run.time, start + EDGE_S))
    high = int(np.searchsorted(run.time, stop - EDGE_S))
    return Window(low, low + _fast(max(0, high - low)), moving)


SPLINE_HZ = 200.0
"""Knots between which a delayed motion is interpolated: its derivatives end at 20 Hz."""
RINGING_SPLINE_HZ = 500.0


class DriverSource:
    """Drivers of each run at given template values, remembered for the last few."""

    def __init__(self, campaign: Campaign, response: Response | None = None) -> None:
        """Take the campaign whose runs' drivers are wanted, and the gyro's filter where it is known."""
        self._response = response
        n = len(campaign.runs)
        self._cached = lru_cache(maxsize=2 * n)(self._make)
        self._moved = lru_cache(maxsize=4 * n)(self._shifted)
        self._forced = lru_cache(maxsize=4 * n)(self._rail_force)
        # what is not shifted is wanted again and again, however many delays are tried
        self._on_time = lru_cache(maxsize=n)(lambda data: self._shifted(data, 0.0))
        self._felt_on_time = lru_cache(maxsize=n)(lambda data: self._rail_force(data, 0.0))
        self._slope = lru_cache(maxsize=n)(lambda data: first_slope(data.run))
        self._spline = lru_cache(maxsize=n)(_motion_spline)
        self._rung = lru_cache(maxsize=4 * n)(self._ringing)
        self._ringing_spline = lru_cache(maxsize=n)(_ringing_spline)
        known = [float(r.run.supply.mean()) for r in campaign.fit if r.run.supply is not None]
        self.supply_reference = float(np.mean(known)) if known else None
        """V0 of supply_voltage: the fit runs' mean, V."""

    def of(self, data: RunData, templates: Templates) -> Drivers:
        """Drivers on the run's whole grid."""
        return self._cached(data, templates)

    def _make(self, data: RunData, templates: Templates) -> Drivers:
        delay = templates.gyro_delay_s
        force = self._force(data, delay)
        ringing = self._rung(data, delay)
        return Drivers(
            kinematics=self._kinematics(data, delay),
            mounting=data.mounting,
            specific_force=None if force is None else force.vectors,
            temperature=lagged_temperature(data.run, templates.temperature_lag_s, self._slope(data)),
            time=data.run.time,
            supply=None if data.run.supply is None else data.run.supply - (self.supply_reference or 0.0),
            response=self._response,
            templates=templates,
            rail_force=force,
            ringing=None if ringing is None else ringing[:, :2],
        )

    def _kinematics(self, data: RunData, gyro_delay_s: float) -> Kinematics:
        return self._moved(data, gyro_delay_s) if gyro_delay_s else self._on_time(data)

    def _force(self, data: RunData, gyro_delay_s: float) -> RailForce | None:
        return self._forced(data, gyro_delay_s) if gyro_delay_s else self._felt_on_time(data)

    def _shifted(self, data: RunData, gyro_delay_s: float) -> Kinematics:
        time = data.run.time - data.delay_s
        if data.motion is None:
            return Kinematics.at_rest(0.0, len(time))
        if gyro_delay_s == 0.0 or data.motion.moving is None:
            return data.motion.at(time)
        return Kinematics(*np.ascontiguousarray(self._spline(data)(time - gyro_delay_s).T))

    def _rail_force(self, data: RunData, gyro_delay_s: float) -> RailForce | None:
        """Gravity and the carriage's acceleration, its ringing too, in the sensor's axes; None without a mounting."""
        mounting = data.mounting
        if mounting is None:
            return None
        acceleration = self._kinematics(data, gyro_delay_s).acceleration
        ringing = self._rung(data, gyro_delay_s)
        if ringing is not None:
            acceleration = acceleration + ringing[:, 0] + ringing[:, 2]
        along = np.zeros(3) if mounting.along is None else mounting.along
        series = np.stack([np.ones(len(acceleration)), acceleration])
        return RailForce(series, np.stack([mounting.gravity * mounting.up, along]))

    def _ringing(self, data: RunData, gyro_delay_s: float) -> FloatArray | None:
        if data.motion is None or data.motion.ringing is None:
            return None
        time = data.run.time - data.delay_s
        return np.asarray(
            self._ringing_spline(data)(time - gyro_delay_s) if gyro_delay_s else data.motion.ringing_at(time)
        )


def _ringing_spline(data: RunData) -> CubicSpline:
    """The same of the acceleration and jerk that are felt above the motion's own."""
    time = data.run.time - data.delay_s
    knots = np.arange(time[0] - 0.3, time[-1] + 0.3, 1.0 / max(RINGING_SPLINE_HZ, data.run.rate_hz))
    return CubicSpline(knots, np.zeros((len(knots), 3)) if data.motion is None else data.motion.ringing_at(knots))


def _motion_spline(data: RunData) -> CubicSpline:
    """The run's motion on knots, to be shifted in time quickly; constant beyond its ends."""
    rate = max(SPLINE_HZ, data.run.rate_hz)
    time = data.run.time - data.delay_s
    knots = np.arange(time[0] - 0.3, time[-1] + 0.3, 1.0 / rate)
    kin = Kinematics.at_rest(0.0, len(knots)) if data.motion is None else data.motion.at(knots)
    return CubicSpline(knots, np.stack([kin.position, kin.velocity, kin.acceleration, kin.jerk], axis=1))


def first_slope(run: CleanRun) -> float:
    """How fast the temperature changes at the run's beginning, K/s; zero where it is not known."""
    if run.temperature is None:
        return 0.0
    head = max(2, round(2.0 * run.rate_hz))
    return float(np.polyfit(run.time[:head], run.temperature[:head], 1)[0])


def lagged_temperature(run: CleanRun, lag_s: float, slope: float | None = None) -> FloatArray | None:
    """Temperature above the reference through a first-order lag that starts settled, K, shape (n,).

    `slope`: the run's `first_slope`, where it is known already.
    """
    if run.temperature is None:
        return None
    above = run.temperature - TEMPERATURE_REFERENCE
    if lag_s <= 0.0:
        return np.asarray(above)
    # settled on the run's own slope: a ramp through a lag is the ramp, lag_s later
    k = 1.0 - np.exp(-1.0 / (run.rate_hz * lag_s))
    start = above[0] - (first_slope(run) if slope is None else slope) * lag_s
    return np.asarray(lfilter([k], [1.0, k - 1.0], above, zi=[start * (1.0 - k)])[0])
