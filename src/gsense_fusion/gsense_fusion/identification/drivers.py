"""What drives the effects on each run at given values of the searched parameters, remembered for the last few."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache

import numpy as np
from scipy.signal import lfilter

from gsense_fusion.identification.campaign import Campaign, RunData
from gsense_fusion.identification.effects.base import Drivers, Templates, nearest_axis
from gsense_fusion.identification.effects.design import RailForce
from gsense_fusion.identification.kept import kept
from gsense_fusion.identification.motion.delayed import Delayed
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import FloatArray

TEMPERATURE_REFERENCE = 25.0
"""T0 of temperature_bias in degrees Celsius."""
LAGS_KEPT = 8
SPLINE_HZ = 200.0
"""Knots between which a delayed motion is interpolated, at least: its derivatives end at 20 Hz."""
RINGING_SPLINE_HZ = 500.0


class DriverSource:
    """Drivers of each run at given template values, remembered for the last few."""

    def __init__(self, campaign: Campaign, response: Response | None = None) -> None:
        """Take the campaign whose runs' drivers are wanted, and the gyro's filter where it is known."""
        self._response = response
        n = len(campaign.runs)
        self._driven = kept(2 * n, self._make)
        self._moved = kept(4 * n, self._shifted)
        self._forced = kept(4 * n, self._rail_force)
        # what is not shifted is wanted again and again, however many delays are tried
        self._on_time = kept(n, self._shifted)
        self._felt_on_time = kept(n, self._rail_force)
        self._runs = campaign.runs
        self._lagged = kept(LAGS_KEPT, self._lagged_starts)
        self._delayed = lru_cache(maxsize=n)(_delayed_motion)
        self._rung = kept(4 * n, self._ringing)
        self._rung_on_time = kept(n, self._ringing)
        self._delayed_ringing = lru_cache(maxsize=n)(_delayed_ringing)
        axes = (nearest_axis(r.mounting) for r in campaign.runs if r.motion is not None)
        self._first_axis = next((axis for axis in axes if axis is not None), None)
        known = [float(r.run.supply.mean()) for r in campaign.fit if r.run.supply is not None]
        self.supply_reference = float(np.mean(known)) if known else None
        """V0 of supply_voltage: the fit runs' mean, V."""

    def of(self, data: RunData, templates: Templates) -> Drivers:
        """Drivers on the run's whole grid."""
        return replace(self._driven(data, templates.gyro_delay_s, templates.temperature_lag_s), templates=templates)

    def _make(self, data: RunData, delay: float, temperature_lag_s: float) -> Drivers:
        force = self._force(data, delay)
        ringing = self._ringing_of(data, delay)
        return Drivers(
            kinematics=self._kinematics(data, delay),
            on_time=self._kinematics(data, 0.0) if delay else None,
            mounting=data.mounting,
            force=force,
            temperature=self._temperature(data, temperature_lag_s),
            time=data.run.time,
            supply=None if data.run.supply is None else data.run.supply - (self.supply_reference or 0.0),
            response=self._response,
            ringing=None if ringing is None else ringing[:2],
            first_axis=self._first_axis,
        )

    def _temperature(self, data: RunData, lag_s: float) -> FloatArray | None:
        start = self._lagged(lag_s).get(data) if lag_s > 0.0 else None
        return lagged_temperature(data.run, lag_s, start)

    def _lagged_starts(self, lag_s: float) -> dict[RunData, float]:
        return lagged_starts(self._runs, lag_s)

    def _kinematics(self, data: RunData, gyro_delay_s: float) -> Kinematics:
        return (self._moved if gyro_delay_s else self._on_time)(data, gyro_delay_s)

    def _force(self, data: RunData, gyro_delay_s: float) -> RailForce | None:
        return (self._forced if gyro_delay_s else self._felt_on_time)(data, gyro_delay_s)

    def _ringing_of(self, data: RunData, gyro_delay_s: float) -> FloatArray | None:
        return (self._rung if gyro_delay_s else self._rung_on_time)(data, gyro_delay_s)

    def _shifted(self, data: RunData, gyro_delay_s: float) -> Kinematics:
        time = data.run.time - data.delay_s
        if data.motion is None:
            return Kinematics.at_rest(0.0, len(time))
        if gyro_delay_s == 0.0 or data.motion.moving is None:
            return data.motion.at(time)
        return Kinematics(*self._delayed(data).by(gyro_delay_s))

    def _rail_force(self, data: RunData, gyro_delay_s: float) -> RailForce | None:
        """Gravity and the carriage's acceleration, its ringing too, in the sensor's axes; None without a mounting."""
        mounting = data.mounting
        if mounting is None:
            return None
        acceleration = self._kinematics(data, gyro_delay_s).acceleration
        ringing = self._ringing_of(data, gyro_delay_s)
        if ringing is not None:
            acceleration = acceleration + ringing[0] + ringing[2]
        along = np.zeros(3) if mounting.along is None else mounting.along
        series = np.stack([np.ones(len(acceleration)), acceleration])
        return RailForce(series, np.stack([mounting.gravity * mounting.up, along]))

    def _ringing(self, data: RunData, gyro_delay_s: float) -> FloatArray | None:
        if data.motion is None or data.motion.ringing is None:
            return None
        if gyro_delay_s:
            return self._delayed_ringing(data).by(gyro_delay_s)
        return data.motion.ringing_at(data.run.time - data.delay_s)


def _delayed_ringing(data: RunData) -> Delayed:
    """The same of the acceleration and jerk that are felt above the motion's own."""

    def felt(time: FloatArray) -> FloatArray:
        return np.zeros((3, len(time))) if data.motion is None else data.motion.ringing_at(time)

    return Delayed.of(data.run.time - data.delay_s, data.run.rate_hz, felt, RINGING_SPLINE_HZ)


def _delayed_motion(data: RunData) -> Delayed:
    """The run's motion, to be shifted in time quickly; constant beyond its ends."""

    def moved(time: FloatArray) -> FloatArray:
        kin = Kinematics.at_rest(0.0, len(time)) if data.motion is None else data.motion.at(time)
        return np.stack([kin.position, kin.velocity, kin.acceleration, kin.jerk])

    return Delayed.of(data.run.time - data.delay_s, data.run.rate_hz, moved, SPLINE_HZ)


def lagged_temperature(run: CleanRun, lag_s: float, start: float | None = None) -> FloatArray | None:
    """Temperature above the reference through a first-order lag, K, shape (n,).

    `start`: the lagged one before the first sample; settled on the run's own slope where None.
    """
    if run.temperature is None:
        return None
    above = run.temperature - TEMPERATURE_REFERENCE
    if lag_s <= 0.0:
        return np.asarray(above)
    k = 1.0 - np.exp(-1.0 / (run.rate_hz * lag_s))
    start = _settled(run, above, lag_s) if start is None else start
    return np.asarray(lfilter([k], [1.0, k - 1.0], above, zi=[start * (1.0 - k)])[0])


def lagged_starts(runs: Sequence[RunData], lag_s: float) -> dict[RunData, float]:
    """What `lagged_temperature` starts from in each run, K: what the run before it in its session left.

    Between two runs the temperature is taken to go straight from one to the other.
    """
    starts: dict[RunData, float] = {}
    before: CleanRun | None = None
    last = level = 0.0
    for data in sorted(runs, key=lambda r: float(r.run.time[0])):
        run = data.run
        if run.temperature is None:
            before = None
            continue
        above = run.temperature - TEMPERATURE_REFERENCE
        gap = 0.0 if before is None or before.session != run.session else float(run.time[0] - before.time[-1])
        if gap > 0.0:
            behind = (above[0] - last) / gap * lag_s  # a ramp through a lag is the ramp, lag_s later
            starts[data] = float(above[0] - behind + (level - last + behind) * np.exp(-gap / lag_s))
        else:
            starts[data] = _settled(run, above, lag_s)
        stay = np.exp(-np.arange(len(above), -1.0, -1.0) / (run.rate_hz * lag_s))
        level = float(stay[0] * starts[data] + (1.0 - stay[-2]) * (stay[1:] @ above))
        last, before = float(above[-1]), run
    return starts


def _settled(run: CleanRun, above: FloatArray, lag_s: float) -> float:
    """The lagged temperature of a board that has warmed for long as it does in the run's first seconds."""
    head = max(2, round(2.0 * run.rate_hz))
    return float(above[0] - np.polyfit(run.time[:head], above[:head], 1)[0] * lag_s)
