"""The live estimator over a recording: the same start, sample by sample, then whole blocks; the same numbers.

What decides about the start (rest, first field, a reset of the clock) goes through `Fusion` as it would live. Behind it
nothing depends on the order of calls any more, so each filter takes the rest of the recording in one call.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gsense_fusion.compensation import gather_inputs

from .fusion import Estimate, Fusion
from .interface import FloatArray, IntArray
from .stream import TEMPERATURE

Series = tuple[IntArray, FloatArray]
"""Stamps (ns, increasing) and values."""
_NO_SERIES: Series = (np.empty(0, dtype=np.int64), np.empty(0))


@dataclass(frozen=True)
class Recording:
    """What the live node would have received; samples in the order of their reception."""

    stamp_ns: IntArray
    angular_rate: FloatArray
    """rad/s, shape (n, 3); rows of NaN are left out."""
    specific_force: FloatArray
    """m/s^2, shape (n, 3); rows of NaN where not reported."""
    field: Series | None = None
    """Magnetic fields, shape (m, 3)."""
    temperature: Series | None = None
    supply: Series | None = None
    carriage: Series | None = None
    """Positions of the carriage, m."""
    carriage_velocity: FloatArray | None = None
    """m/s, as many as positions; NaN where unknown."""
    own: Series | None = None
    """Attitudes of the sensor's own fusion, body -> ENU, (w, x, y, z), shape (m, 4)."""


@dataclass
class Estimates:
    """What the channels made of it."""

    rows: NDArray[np.intp]
    """Which samples of the recording were used, shape (k,)."""
    quaternion: dict[str, FloatArray]
    """Channel -> body -> ENU, (w, x, y, z), shape (k, 4)."""
    angular_rate: dict[str, FloatArray]
    """Channel -> rad/s, shape (k, 3), with its bias."""


@dataclass
class _Parts:
    rows: list[NDArray[np.intp]] = field(default_factory=list)
    quaternion: dict[str, list[FloatArray]] = field(default_factory=dict)
    rate: dict[str, list[FloatArray]] = field(default_factory=dict)

    def add(self, channel: str, quaternion: FloatArray, rate: FloatArray) -> None:
        self.quaternion.setdefault(channel, []).append(quaternion)
        self.rate.setdefault(channel, []).append(rate)


def run_offline(fusion: Fusion, recording: Recording) -> Estimates:
    """Take a whole recording through a fresh `Fusion`.

    Args:
        fusion: with its channels, before the first sample; afterwards its status tells of the run.
        recording: what it would have received.

    Returns:
        Attitudes of every channel; none where the recording is shorter than the start needs.
    """
    return _Run(fusion, recording).all()


class _Run:
    def __init__(self, fusion: Fusion, recording: Recording) -> None:
        self.fusion, self.r = fusion, recording
        self.parts = _Parts()
        self.newest = np.maximum.accumulate(recording.stamp_ns) if len(recording.stamp_ns) else recording.stamp_ns
        self.field = _Readings(recording.field, self.newest)
        self.own = _Readings(recording.own, self.newest)
        self.temperature = _Readings(recording.temperature, self.newest)
        self.inputs = gather_inputs(self.newest, None, recording.supply, self._velocity())
        self.positions = 0

    def _velocity(self) -> Series | None:
        r = self.r
        return (r.carriage[0], r.carriage_velocity) if r.carriage and r.carriage_velocity is not None else None

    def all(self) -> Estimates:
        i, n = 0, len(self.r.stamp_ns)
        while i < n:
            if self._settled():
                i = self._block(i)
            if i < n:
                self._single(i)
                i += 1
        parts = self.parts
        rows = np.concatenate(parts.rows) if parts.rows else np.empty(0, dtype=np.intp)
        quaternion = {name: np.concatenate(p) for name, p in parts.quaternion.items()}
        rate = {name: np.concatenate(p) for name, p in parts.rate.items()}
        return Estimates(rows, quaternion, rate)

    def _settled(self) -> bool:
        """Whether nothing but a reset can change the course of things."""
        status = self.fusion.status
        return status.running and status.rest_seen and (status.uses_field or not self.field.more)

    def _add_positions(self, until_ns: int | None) -> None:
        if self.r.carriage is None:
            return
        stamps, values = self.r.carriage
        end = len(stamps) if until_ns is None else int(np.searchsorted(stamps, until_ns, side="right"))
        if end > self.positions:
            for stream in self.fusion.streams:
                stream.add_positions(stamps[self.positions : end], values[self.positions : end])
        self.positions = max(self.positions, end)

    def _single(self, i: int) -> None:
        r, fusion = self.r, self.fusion
        self._add_positions(int(self.newest[i]))
        self.inputs[i, TEMPERATURE] = self.temperature.new_at(i)
        fusion.set_known(self.inputs[i], self.field.new_at(i), self.own.new_at(i))
        used = fusion.timer.counts.samples
        self._keep(fusion.add_sample(int(r.stamp_ns[i]), r.angular_rate[i], r.specific_force[i], i))
        if fusion.timer.counts.samples > used:
            self.field.hand_over(i)
            self.own.hand_over(i)
            self.temperature.hand_over(i)

    def _keep(self, estimates: list[Estimate]) -> None:
        if not estimates:
            return
        count = len(self.fusion.channels)
        self.parts.rows.append(np.array([e.source for e in estimates[::count]], dtype=np.intp))
        for k in range(count):
            mine = estimates[k::count]
            self.parts.add(
                mine[0].channel, np.array([e.quaternion for e in mine]), np.array([e.angular_rate for e in mine])
            )

    def _block(self, i: int) -> int:
        """Take all samples from `i` on up to a reset; returns the next one."""
        r, fusion = self.r, self.fusion
        finite = np.flatnonzero(np.isfinite(r.angular_rate[i:]).all(axis=1)) + i
        used, dt, taken = fusion.timer.batch(r.stamp_ns[finite])
        fusion.status.usual_s = fusion.timer.usual_s
        rows = finite[:taken][used]
        self._add_positions(None)
        if len(rows):
            self._filter(rows, dt[used])
        return int(finite[taken]) if taken < len(finite) else len(r.stamp_ns)

    def _filter(self, rows: NDArray[np.intp], dt: FloatArray) -> None:
        r = self.r
        fields = self.field.new_in(rows) if self.fusion.status.uses_field else None
        inputs = self.inputs[rows]
        if r.temperature is not None:
            inputs[:, TEMPERATURE] = self.temperature.new_in(rows)
        own = self.own.new_in(rows) if r.own is not None else None
        self.parts.rows.append(rows)
        for stream in self.fusion.streams:
            sample = stream.block(r.stamp_ns[rows], r.angular_rate[rows], r.specific_force[rows], fields, inputs)
            sample.own = own
            for channel, quaternion in zip(stream.channels, stream.batch(dt, sample), strict=True):
                self.parts.add(channel.name, quaternion, sample.rate)


class _Readings:
    """A slower series beside the samples: each reading goes to the first sample after it that is used."""

    def __init__(self, series: Series | None, newest_ns: IntArray) -> None:
        stamps, values = series if series is not None else _NO_SERIES
        good = np.isfinite(values) if values.ndim == 1 else np.isfinite(values).all(axis=1)
        self.values = values[good]
        self.at = np.searchsorted(stamps[good], newest_ns, side="right") - 1
        """The newest reading at each sample."""
        self.given = -1
        """The newest one that a used sample has had."""

    @property
    def more(self) -> bool:
        """Whether there are readings that no sample has had."""
        return bool(len(self.at)) and self.at[-1] > self.given

    def new_at(self, i: int) -> FloatArray:
        """The reading that is new for sample i; NaN where there is none."""
        return self._values(self.at[i : i + 1], np.array([self.given]))[0]

    def new_in(self, rows: NDArray[np.intp]) -> FloatArray:
        """The same for each of the used samples `rows`, which have it then."""
        index = self.at[rows]
        found = self._values(index, np.concatenate(([self.given], index[:-1])))
        self.hand_over(int(rows[-1]))
        return found

    def hand_over(self, i: int) -> None:
        """Sample i is used."""
        self.given = int(self.at[i])

    def _values(self, index: NDArray[np.intp], before: NDArray[np.intp]) -> FloatArray:
        found = np.full((len(index), *self.values.shape[1:]), np.nan)
        new = index > before
        found[new] = self.values[index[new]]
        return found
