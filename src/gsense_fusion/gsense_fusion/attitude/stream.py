"""One way of a sample to the filters: as measured, or compensated. Both ways are the same code with and without file.

What a filter gets: the rate less its bias, the specific force (corrected where the file corrects the accelerometer;
less the carriage's acceleration for filters that use it), and the field (corrected likewise).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gsense_fusion.compensation import CompensationFile, Compensator, corrected_field, corrected_force

from .carriage import CarriageAid
from .interface import AttitudeFilter, FloatArray, IntArray
from .own import directions

TEMPERATURE, SUPPLY, VELOCITY = 0, 1, 2
"""Columns of what else is known at a sample, as `compensation.gather_inputs` has them."""


@dataclass(frozen=True)
class Channel:
    """One output: a filter fed with the raw or with the compensated rate."""

    name: str
    filter: AttitudeFilter
    compensated: bool
    uses_carriage: bool = False
    """Fed with the specific force less the carriage's acceleration."""
    own_bias: float = 0.0
    """rad/s: a bias up to this is left to the filter."""

    uses_own: bool = False
    """Fed with the sensor's own attitude, in the places of specific force and field (see `own`)."""

    def finds(self, bias: FloatArray) -> bool:
        """Whether the bias at rest, rad/s, shape (3,), is left in the rate for the filter to find."""
        return float(np.max(np.abs(bias))) <= self.own_bias


@dataclass(slots=True)
class Sample:
    """A sample on its way; for a block of n samples every array has n rows."""

    rate: FloatArray
    """rad/s, shape (3,), with its bias."""
    force: FloatArray
    """m/s^2, shape (3,), NaN where not reported."""
    clean_force: FloatArray
    """The same, less the carriage's acceleration; NaN where that is not known."""
    field: FloatArray | None
    own: FloatArray | None = None
    """The sensor's own attitude, body -> ENU, (w, x, y, z), shape (4,); in a block rows of NaN where none is new."""


class Stream:
    """The channels of one way, and what happens to a sample before it reaches them."""

    def __init__(self, channels: Sequence[Channel], file: CompensationFile | None) -> None:
        self.channels = tuple(channels)
        self.file = file
        self.bias = np.zeros(3)
        self._aid = CarriageAid() if any(channel.uses_carriage for channel in self.channels) else None
        self._compensator = Compensator(file) if file is not None else None

    @property
    def bias(self) -> FloatArray:
        """Bias at rest, rad/s, shape (3,)."""
        return self._bias

    @bias.setter
    def bias(self, value: FloatArray) -> None:
        self._bias = value
        self._finds = [channel.finds(value) for channel in self.channels]

    def restart(self) -> None:
        """Forget the past, before the first sample of a new beginning."""
        if self._aid is not None:
            self._aid.restart()
        if self.file is not None:
            self._compensator = Compensator(self.file)

    def add_position(self, stamp_ns: int, position: float) -> None:
        """A position of the carriage, m."""
        if self._aid is not None:
            self._aid.add_position(stamp_ns, position)

    def add_positions(self, stamp_ns: IntArray, position: FloatArray) -> None:
        """Positions of the carriage, m, shape (n,)."""
        if self._aid is not None:
            self._aid.add_positions(stamp_ns, position)

    def field(self, field: FloatArray) -> FloatArray:
        """The field as the filters of this way see it."""
        return corrected_field(self.file, field) if self.file is not None else field

    def sample(
        self, stamp_ns: int, rate: FloatArray, force: FloatArray, field: FloatArray | None, inputs: FloatArray
    ) -> Sample:
        """One sample; stamps increase."""
        if self._compensator is not None and self.file is not None:
            self._compensator.set_temperature(inputs[TEMPERATURE])
            self._compensator.set_supply(inputs[SUPPLY])
            self._compensator.set_carriage_velocity(inputs[VELOCITY])
            rate = self._compensator.update(stamp_ns, rate, force)
            force = np.ascontiguousarray(corrected_force(self.file, force))
        clean = self._aid.clean(stamp_ns, force) if self._aid is not None else force
        return Sample(rate, force, clean, None if field is None else np.ascontiguousarray(self.field(field)))

    def block(
        self, stamp_ns: IntArray, rate: FloatArray, force: FloatArray, field: FloatArray | None, inputs: FloatArray
    ) -> Sample:
        """`sample` for many, going on from the last one."""
        if self._compensator is not None and self.file is not None:
            rate = self._compensator.batch(stamp_ns, rate, force, inputs)
            force = np.ascontiguousarray(corrected_force(self.file, force))
        clean = self._aid.clean_block(stamp_ns, force) if self._aid is not None else force
        return Sample(rate, force, clean, None if field is None else self.field(field))

    def update(self, dt: float, sample: Sample) -> list[FloatArray]:
        """Every channel's attitude after the sample, shape (4,) each."""
        free = sample.rate - self._bias
        return [
            self._update_own(channel, dt, free, sample)
            if channel.uses_own
            else channel.filter.update(
                dt,
                sample.rate if finds else free,
                sample.clean_force if channel.uses_carriage else sample.force,
                sample.field,
            )
            for channel, finds in zip(self.channels, self._finds, strict=True)
        ]

    def _update_own(self, channel: Channel, dt: float, rate: FloatArray, sample: Sample) -> FloatArray:
        if sample.own is None:
            return channel.filter.update(dt, rate, sample.force)
        up, north = directions(sample.own[None])
        return channel.filter.update(dt, rate, up[0], north[0])

    def batch(self, dt: FloatArray, sample: Sample) -> list[FloatArray]:
        """The same for a block, shape (n, 4) each."""
        free = sample.rate - self._bias
        own = None if sample.own is None else directions(sample.own)
        return [
            channel.filter.batch(dt, free, *(own or (sample.force, None)))
            if channel.uses_own
            else channel.filter.batch(
                dt,
                sample.rate if finds else free,
                sample.clean_force if channel.uses_carriage else sample.force,
                sample.field,
            )
            for channel, finds in zip(self.channels, self._finds, strict=True)
        ]
