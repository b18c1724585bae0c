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
        stamps = recording.field[0] if recording.field is not None else _NO_SERIES[0]
        self.field_at = np.searchsorted(stamps, self.newest, side="right") - 1
        self.inputs = gather_inputs(self.newest, recording.temperature, recording.supply, self._velocity())
        self.positions = 0

    def _velocity(self) -> Series | None:
        r = self.r
        return (r.carriage[0], r.carriage_velocity) if r.carriage and r.carriage_velocity is not None else None

    def all(self) -> Estimates:
        i, n = 0, len(self.r.stamp_ns)
        while i < n:
            if self._settled(i):
                i = self._block(i)
            if i < n:
                self._single(i)
                i += 1
        parts = self.parts
        rows = np.concatenate(parts.rows) if parts.rows else np.empty(0, dtype=np.intp)
        quaternion = {name: np.concatenate(p) for name, p in parts.quaternion.items()}
        rate = {name: np.concatenate(p) for name, p in parts.rate.items()}
        return Estimates(rows, quaternion, rate)

    def _settled(self, i: int) -> bool:
        """Whether nothing but a reset can change the course of things."""
        status = self.fusion.status
        return status.running and status.rest_seen and (status.uses_field or self.field_at[-1] == self.field_at[i - 1])

    def _add_positions(self, until_ns: int | None) -> None:
        if self.r.carriage is None:
            return
        stamps, values = self.r.carriage
        end = len(stamps) if until_ns is None else int(np.searchsorted(stamps, until_ns, side="right"))
        for k in range(self.positions, end):
            for stream in self.fusion.streams:
                stream.add_position(int(stamps[k]), float(values[k]))
        self.positions = max(self.positions, end)

    def _single(self, i: int) -> None:
        r, fusion = self.r, self.fusion
        if r.field is not None and self.field_at[i] > (self.field_at[i - 1] if i else -1):
            fusion.add_field(r.field[1][self.field_at[i]])
        self._add_positions(int(self.newest[i]))
        fusion.set_inputs(self.inputs[i])
        self._keep(fusion.add_sample(int(r.stamp_ns[i]), r.angular_rate[i], r.specific_force[i], i))

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
            self._filter(i, rows, dt[used])
        return int(finite[taken]) if taken < len(finite) else len(r.stamp_ns)

    def _filter(self, i: int, rows: NDArray[np.intp], dt: FloatArray) -> None:
        r = self.r
        fields = self._fields(i, rows)
        self.parts.rows.append(rows)
        for stream in self.fusion.streams:
            sample = stream.block(
                r.stamp_ns[rows], r.angular_rate[rows], r.specific_force[rows], fields, self.inputs[rows]
            )
            for channel in stream.channels:
                self.parts.add(channel.name, stream.batch(channel, dt, sample), sample.rate)

    def _fields(self, i: int, rows: NDArray[np.intp]) -> FloatArray | None:
        """The field that is new with each sample, NaN where there is none."""
        if self.r.field is None or not self.fusion.status.uses_field:
            return None
        index = self.field_at[rows]
        before = np.concatenate(([self.field_at[i - 1]], index[:-1]))
        fields = np.full((len(rows), 3), np.nan)
        new = index > before
        fields[new] = self.r.field[1][index[new]]
        return fields
