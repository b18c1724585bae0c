"""The live estimator without ROS: samples in, attitudes of every filter out, without and with g-compensation.

The first second of samples is held back. If it is at rest, it gives the gyro bias (of the raw rate for the outputs
without compensation, of the compensated rate for those with it) and the attitude; then the held samples go through the
filters, so every sample gets its output. If it is not at rest, the filters start from its mean specific force and the
bias of the compensation file (else zero), and both are corrected once a second at rest comes by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

import numpy as np

from gsense_fusion.compensation import CompensationFile

from .held import Held, Measured, settle_inputs
from .initial import attitude_at_rest, headed, levelled
from .interface import FloatArray
from .rest import is_rest
from .stream import SUPPLY, TEMPERATURE, VELOCITY, Channel, Stream
from .timing import StepKind, StepTimer, TimingCounts


@dataclass(frozen=True)
class FusionSettings:
    """How the estimator starts."""

    rest_s: float = 1.0
    """Length of the stretch at rest that gives bias and attitude."""
    longest_step_s: float = 0.1
    """Intervals are cut to this; see `StepTimer`."""


# what follows is made for each sample: not frozen, which takes four times as long
@dataclass(slots=True)
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
        raw = Stream([c for c in self.channels if not c.compensated], None)
        compensated = [Stream([c for c in self.channels if c.compensated], compensation)] if compensation else []
        self.streams = (raw, *compensated)
        self.timer = StepTimer(self.settings.longest_step_s)
        self._field: FloatArray | None = None
        self._own: FloatArray | None = None
        self._inputs = np.full(3, np.nan)
        self._window: list[Measured] = []
        self._held: list[Held] = []
        self.status = FusionStatus(self.timer.counts)

    def add_temperature(self, celsius: float) -> None:
        """A new die temperature, degrees Celsius; used with the next sample that is not dropped."""
        if np.isfinite(celsius):
            self._inputs[TEMPERATURE] = celsius

    def add_supply(self, volts: float) -> None:
        """The newest supply voltage."""
        if np.isfinite(volts):
            self._inputs[SUPPLY] = volts

    def add_carriage(self, stamp_ns: int, position: float, velocity: float = np.nan) -> None:
        """The carriage on the rail: position m, velocity m/s (NaN: not reported, the last one stays)."""
        if np.isfinite(velocity):
            self._inputs[VELOCITY] = velocity
        for stream in self.streams:
            stream.add_position(stamp_ns, position)

    def add_own(self, quaternion: FloatArray) -> None:
        """A new attitude of the sensor's own fusion, (w, x, y, z), shape (4,); used with the next sample."""
        if np.isfinite(quaternion).all() and np.any(quaternion):
            self._own = np.asarray(quaternion, dtype=np.float64)

    def set_known(self, inputs: FloatArray, field: FloatArray, own: FloatArray) -> None:
        """All that is known at the next sample at once.

        Args:
            inputs: temperature (NaN: no new reading), supply and the carriage's velocity, shape (3,).
            field: magnetic field, shape (3,); NaN: no new one.
            own: attitude of the sensor's own fusion, shape (4,); NaN: no new one.
        """
        self._inputs[:] = inputs
        self._field = self._own = None
        self.add_own(own)
        self.add_field(field)

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
        if not isfinite(angular_rate.dot(angular_rate)):  # ten times as quick as numpy's isfinite and all
            return []
        kind, dt = self.timer.step(stamp_ns)
        self.status.usual_s = self.timer.usual_s
        if kind is StepKind.DROP:
            return []
        if kind is StepKind.RESET:
            self._begin_anew()
        measured = self._measured(stamp_ns, dt, angular_rate, specific_force, source)
        if self.status.running:
            held = self._through(measured)
            if not self.status.rest_seen:
                self._seek_rest(held)
            return self._filter(held)
        # compensated only at the start, when the temperature is known
        self._window.append(measured)
        self.status.start = "starting: collecting the first second"
        if stamp_ns - self._window[0].stamp_ns < self.settings.rest_s * 1e9:
            return []
        return self._start()

    def _begin_anew(self) -> None:
        self._window.clear()
        self._held.clear()
        for stream in self.streams:
            stream.restart()
        self.status.running = self.status.rest_seen = False

    def _measured(self, stamp_ns: int, dt: float, rate: FloatArray, force: FloatArray, source: Any) -> Measured:
        field, self._field = self._field, None
        own, self._own = self._own, None
        inputs = self._inputs.copy()
        self._inputs[TEMPERATURE] = np.nan  # a reading is used once
        return Measured(stamp_ns, dt, rate, force, field, own, inputs, source)

    def _through(self, m: Measured) -> Held:
        samples = tuple(s.sample(m.stamp_ns, m.rate, m.force, m.field, m.inputs) for s in self.streams)
        for sample in samples:
            sample.own = m.own
        return Held(m, samples)

    def _start(self) -> list[Estimate]:
        settle_inputs([m.inputs for m in self._window])
        self._held = [self._through(measured) for measured in self._window]
        self._window = []
        status = self.status
        status.rest_seen = self._held_rests()
        if status.rest_seen:
            self._take_bias()
            status.start = "attitude and bias from the first second at rest"
        else:
            known = self._file is not None and any(self._file.bias)
            for stream in self.streams:
                stream.bias = np.array(self._file.bias if self._file is not None else (0.0, 0.0, 0.0))
            status.start = (
                "no rest in the first second: attitude from its mean specific force, bias "
                + ("of the compensation file" if known else "zero")
                + "; both are corrected at the first second of rest"
            )
        self._prepare_filters()
        self._set_attitude(first=True)
        self._show_bias()
        status.running = True
        held = self._held
        if status.rest_seen:
            self._held = []
        return [estimate for item in held for estimate in self._filter(item)]

    def _prepare_filters(self) -> None:
        first = self._held[0].measured.stamp_ns
        at = [(h.measured.stamp_ns - first) * 1e-9 for h in self._held if h.measured.field is not None]
        field_period = (at[-1] - at[0]) / (len(at) - 1) if len(at) > 1 else None
        intervals = [h.measured.dt for h in self._held if h.measured.dt > 0]
        period = float(np.median(intervals)) if intervals else 0.005
        for channel in self.channels:
            channel.filter.prepare(period, field_period)

    def _held_rests(self) -> bool:
        return is_rest(
            np.array([h.measured.rate for h in self._held]), np.array([h.measured.force for h in self._held])
        )

    def _take_bias(self) -> None:
        for i, stream in enumerate(self.streams):
            stream.bias = np.mean([h.samples[i].rate for h in self._held], axis=0)

    def _show_bias(self) -> None:
        self.status.bias = {False: self.streams[0].bias, True: self.streams[-1].bias}

    def _set_attitude(self, first: bool) -> None:
        """From the window's means; later than at the first start without a field, the heading is kept."""
        for i, stream in enumerate(self.streams):
            force = np.mean([h.samples[i].force for h in self._held], axis=0)
            fields = [f for h in self._held if (f := h.samples[i].field) is not None]
            for channel in stream.channels:
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

    def _seek_rest(self, held: Held) -> None:
        """After a start in motion: a sliding second, looked at four times a second."""
        self._held.append(held)
        newest = held.measured.stamp_ns
        span = round(self.settings.rest_s * 1e9)
        if newest - self._held[0].measured.stamp_ns < span * 5 // 4:
            return
        self._held = [h for h in self._held if newest - h.measured.stamp_ns <= span]
        if self._held_rests():
            self._take_bias()
            self._show_bias()
            self._set_attitude(first=False)
            self.status.rest_seen = True
            self.status.start = "started in motion; attitude and bias corrected at the first second of rest"
            self._held = []

    def _filter(self, held: Held) -> list[Estimate]:
        measured = held.measured
        if measured.field is not None and not self.status.uses_field:
            self.status.uses_field = True
            for stream, sample in zip(self.streams, held.samples, strict=True):
                for (
                    channel
                ) in stream.channels:  # one that comes up later: its heading at once, not at the filter's pace
                    if sample.field is not None:
                        channel.filter.quaternion = headed(channel.filter.quaternion, sample.field)
        estimates = []
        for stream, sample in zip(self.streams, held.samples, strict=True):
            for channel, quaternion in zip(stream.channels, stream.update(measured.dt, sample), strict=True):
                estimates.append(Estimate(channel.name, measured.stamp_ns, quaternion, sample.rate, measured.source))
        return estimates
