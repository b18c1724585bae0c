"""The live estimator without ROS: samples in, attitudes of every filter out, without and with g-compensation.

The first second of samples is held back. If it is at rest, it gives the gyro bias (of the raw rate for the outputs
without compensation, of the compensated rate for those with it) and the attitude; then the held samples go through the
filters, so every sample gets its output. If it is not at rest, the filters start from its mean specific force and the
bias of the compensation file (else zero), and both are corrected once a second at rest comes by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gsense_fusion.compensation import CompensationFile, Compensator

from .initial import attitude_at_rest, headed, levelled
from .interface import AttitudeFilter, FloatArray
from .rest import is_rest
from .timing import StepKind, StepTimer, TimingCounts


@dataclass(frozen=True)
class FusionSettings:
    """How the estimator starts."""

    rest_s: float = 1.0
    """Length of the stretch at rest that gives bias and attitude."""
    longest_step_s: float = 0.1
    """Intervals are cut to this; see `StepTimer`."""


@dataclass(frozen=True)
class Channel:
    """One output: a filter fed with the raw or with the compensated rate."""

    name: str
    filter: AttitudeFilter
    compensated: bool


@dataclass(frozen=True)
class Estimate:
    """Attitude of one channel after one sample."""

    channel: str
    stamp_ns: int
    quaternion: FloatArray
    """Body -> ENU, (w, x, y, z), shape (4,)."""
    angular_rate: FloatArray
    """rad/s, shape (3,): as measured, or less the terms of the compensation file. The bias is not taken off."""
    source: Any
    """What came with the sample (the message)."""


@dataclass
class FusionStatus:
    """For the log and /diagnostics."""

    counts: TimingCounts
    running: bool = False
    rest_seen: bool = False
    uses_field: bool = False
    bias: dict[bool, FloatArray] = field(default_factory=lambda: {False: np.zeros(3), True: np.zeros(3)})
    """rad/s, of the raw (False) and of the compensated rate (True)."""
    usual_s: float | None = None
    """Usual interval of the samples."""
    start: str = "waiting for samples"
    """How the estimator started, in words."""


@dataclass(frozen=True)
class _Sample:
    stamp_ns: int
    dt: float
    rates: dict[bool, FloatArray]
    force: FloatArray
    field: FloatArray | None
    source: Any


class Fusion:
    """See the module. Not thread-safe: one thread feeds it."""

    def __init__(
        self,
        channels: Sequence[Channel],
        compensation: CompensationFile | None = None,
        settings: FusionSettings | None = None,
    ) -> None:
        self.channels = tuple(channels)
        if compensation is None and any(channel.compensated for channel in self.channels):
            raise ValueError("a compensated channel needs a compensation file")
        self.settings = settings or FusionSettings()
        self._file = compensation
        self._compensator: Compensator | None = None
        self._temperature: float | None = None
        self._timer = StepTimer(self.settings.longest_step_s)
        self._field: FloatArray | None = None
        self._window: list[_Sample] = []
        self.status = FusionStatus(self._timer.counts)

    def add_temperature(self, celsius: float) -> None:
        """The newest die temperature, degrees Celsius."""
        self._temperature = celsius
        if self._compensator is not None:
            self._compensator.set_temperature(celsius)

    def add_field(self, field: FloatArray) -> None:
        """A new magnetic field, any unit, shape (3,); used with the next sample."""
        if np.isfinite(field).all():
            self._field = np.asarray(field, dtype=np.float64)

    def add_sample(
        self, stamp_ns: int, angular_rate: FloatArray, specific_force: FloatArray, source: Any = None
    ) -> list[Estimate]:
        """Take one sample.

        Args:
            stamp_ns: header stamp.
            angular_rate: rad/s, shape (3,).
            specific_force: m/s^2, shape (3,); NaN where not reported.
            source: handed through to the estimates.

        Returns:
            An estimate for each channel; none while starting (they follow when it has started), none for a sample that
            is dropped for its stamp.
        """
        if not np.isfinite(angular_rate).all():
            return []
        kind, dt = self._timer.step(stamp_ns)
        self.status.usual_s = self._timer.usual_s
        if kind is StepKind.DROP:
            return []
        if kind is StepKind.RESET:
            self._window.clear()
            self._compensator = None
            self.status.running = self.status.rest_seen = False
        if self.status.running:
            sample = self._sample(stamp_ns, dt, angular_rate, specific_force, source)
            if not self.status.rest_seen:
                self._seek_rest(sample)
            return self._filter(sample)
        # compensated only at the start, when the temperature is known
        self._window.append(_Sample(stamp_ns, dt, {False: angular_rate}, specific_force, self._take_field(), source))
        self.status.start = "starting: collecting the first second"
        if stamp_ns - self._window[0].stamp_ns < self.settings.rest_s * 1e9:
            return []
        return self._start()

    def _take_field(self) -> FloatArray | None:
        new, self._field = self._field, None
        return new

    def _sample(self, stamp_ns: int, dt: float, rate: FloatArray, force: FloatArray, source: Any) -> _Sample:
        rates = {False: rate, True: self._compensated(stamp_ns, rate, force)}
        return _Sample(stamp_ns, dt, rates, force, self._take_field(), source)

    def _compensated(self, stamp_ns: int, rate: FloatArray, force: FloatArray) -> FloatArray:
        return self._compensator.update(stamp_ns, rate, force) if self._compensator is not None else rate

    def _start(self) -> list[Estimate]:
        if self._file is not None:
            self._compensator = Compensator(self._file)
            if self._temperature is not None:
                self._compensator.set_temperature(self._temperature)
        held = [
            _Sample(
                s.stamp_ns,
                s.dt,
                {False: s.rates[False], True: self._compensated(s.stamp_ns, s.rates[False], s.force)},
                s.force,
                s.field,
                s.source,
            )
            for s in self._window
        ]
        self._window = held
        status = self.status
        status.rest_seen = self._window_rests()
        if status.rest_seen:
            self._take_bias()
            status.start = "attitude and bias from the first second at rest"
        else:
            known = self._file is not None and any(self._file.bias)
            bias = np.array(self._file.bias if self._file is not None else (0.0, 0.0, 0.0))
            status.bias = {False: bias, True: bias}
            status.start = (
                "no rest in the first second: attitude from its mean specific force, bias "
                + ("of the compensation file" if known else "zero")
                + "; both are corrected at the first second of rest"
            )
        self._set_attitude(first=True)
        status.running = True
        if status.rest_seen:
            self._window = []
        return [estimate for sample in held for estimate in self._filter(sample)]

    def _window_rests(self) -> bool:
        rates = np.array([s.rates[False] for s in self._window])
        forces = np.array([s.force for s in self._window])
        return is_rest(rates, forces)

    def _take_bias(self) -> None:
        self.status.bias = {
            compensated: np.mean([s.rates[compensated] for s in self._window], axis=0) for compensated in (False, True)
        }

    def _set_attitude(self, first: bool) -> None:
        """From the window's means; later than at the first start without a field, the heading is kept."""
        forces = np.array([s.force for s in self._window])
        fields = [s.field for s in self._window if s.field is not None]
        force = np.mean(forces, axis=0)
        for channel in self.channels:
            try:
                if fields:
                    channel.filter.quaternion = attitude_at_rest(force, np.mean(fields, axis=0))
                elif first:
                    channel.filter.quaternion = attitude_at_rest(force)
                else:
                    channel.filter.quaternion = levelled(channel.filter.quaternion, force)
            except ValueError:  # no accelerometer: the attitude is counted from the start
                if first:
                    channel.filter.quaternion = np.array([1.0, 0.0, 0.0, 0.0])

    def _seek_rest(self, sample: _Sample) -> None:
        """After a start in motion: a sliding second, looked at four times a second."""
        window = self._window
        window.append(sample)
        span = round(self.settings.rest_s * 1e9)
        if sample.stamp_ns - window[0].stamp_ns < span * 5 // 4:
            return
        self._window = [s for s in window if sample.stamp_ns - s.stamp_ns <= span]
        if self._window_rests():
            self._take_bias()
            self._set_attitude(first=False)
            self.status.rest_seen = True
            self.status.start = "started in motion; attitude and bias corrected at the first second of rest"
            self._window = []

    def _filter(self, sample: _Sample) -> list[Estimate]:
        if sample.field is not None and not self.status.uses_field:
            self.status.uses_field = True
            for channel in self.channels:  # one that comes up later: its heading at once, not at the filter's pace
                channel.filter.quaternion = headed(channel.filter.quaternion, sample.field)
        estimates = []
        for channel in self.channels:
            rate = sample.rates[channel.compensated]
            unbiased = rate - self.status.bias[channel.compensated]
            quaternion = channel.filter.update(sample.dt, unbiased, sample.force, sample.field)
            estimates.append(Estimate(channel.name, sample.stamp_ns, quaternion, rate, sample.source))
        return estimates
