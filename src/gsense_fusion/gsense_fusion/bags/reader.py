"""`load_run`: one bag of any recorder as a `Run`."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import cdr
from .clock_step import Part, longest_part
from .gaps import find_gaps
from .run import (
    ImuSeries,
    JointSeries,
    LinkCounts,
    MagSeries,
    PoseSeries,
    ReferencePose,
    Run,
    ScalarSeries,
)
from .storage import BagError, RawTopic, open_storage
from .table import Table, attitude, reported
from .topics import find_names, imus_beside

_NO_AXIS_VARIANCE = 1e6
_BEYOND_SENSORS = 1e6  # rad/s, m/s^2: a larger one comes of damaged bytes
_STEADY = ("imu/data_raw", "rig/pose", "rig/joint_states")
"""Topics of a steady rate, whose gaps are losses."""
_SAME_START_NS = 10**9
"""Sensors of one board begin and end together, give or take this."""


def load_run(path: Path | str, sensor: str, reference: str | None = None) -> Run:
    """Read a bag.

    Args:
        path: rosbag2 folder, or a bare `.mcap` or `.db3` file; MCAP or SQLite3, compressed or not, any recorder.
        sensor: a sensor's name (`mpu6050`: the topic that ends in `mpu6050/imu/data_raw`, under any namespace) or a
            whole topic (`/imu`), beside which field and temperature are found by their types.
        reference: topic of the attitude to judge by: PoseStamped, or an Imu that reports its orientation.

    Returns:
        The run; what the bag lacks is None, and what was odd is in `notes`.

    Raises:
        BagError: the bag or the sensor's topic cannot be used; one line, with the path and what to do.
    """
    path = Path(path)
    with open_storage(path) as storage:
        names = find_names(path, {topic.name: topic.msgtype for topic in storage.topics.values()}, sensor, reference)
        raw = storage.read(names.all())
    loader = _Loader(path, raw, [*storage.notes, *names.notes])
    loader.cut(names.imu)
    imu = loader.imu(names.imu)
    link, unit_id = loader.link(names.link)
    beside = None if np.isfinite(imu.specific_force).any() else _beside(path, names.imu, imu)
    return Run(
        path=path,
        name=path.stem if path.is_file() else path.resolve().name,
        sensor=names.sensor,
        topic=names.imu,
        imu=imu,
        beside=beside,
        pose=loader.pose(names.pose, imu),
        joint=loader.joint(names.joint, imu),
        motor_current=loader.current(names.state, imu),
        temperature=loader.scalar(names.temperature, "temperature"),
        battery=loader.scalar(names.battery, "voltage"),
        mag=loader.mag(names.mag),
        mag_beside=loader.mag(names.mag_beside),
        reference=loader.reference(names.reference),
        own=loader.imu(names.own) if names.own and names.own != names.imu else None,
        link=link,
        unit_id=unit_id,
        notes=tuple(loader.notes),
    )


def _beside(path: Path, topic: str, imu: ImuSeries) -> ImuSeries | None:
    """The IMU with an accelerometer on the same board, over the sensor's own time; None where there is none."""
    with open_storage(path) as storage:
        others = imus_beside({t.name: t.msgtype for t in storage.topics.values()}, topic)
        raw = storage.read(others)
    for name in (n for n in others if n in raw and raw[n].payloads):
        loader = _Loader(path, raw, [])
        loader.cut(name)
        other = loader.imu(name)
        covers = (
            other.stamp_ns[0] - _SAME_START_NS < imu.stamp_ns[0]
            and imu.stamp_ns[-1] < other.stamp_ns[-1] + _SAME_START_NS
        )
        if covers and np.isfinite(other.specific_force).all():
            return other
    return None


@dataclass
class _Loader:
    path: Path
    raw: dict[str, RawTopic]
    notes: list[str] = field(default_factory=list)
    part: Part | None = None
    """What is used of a recording in whose midst the host's clock was set; None: all of it."""

    def imu(self, name: str) -> ImuSeries:
        table = self._table(name)
        if table is None:
            raise BagError(f"{self.path}: {name} has no messages; was the sensor on when this was recorded?")
        table = self._finite(name, table)
        rate = reported(table, "angular_velocity")
        force = reported(table, "linear_acceleration")
        absent = np.diagonal(table.column("angular_velocity_covariance").reshape(-1, 3, 3), axis1=1, axis2=2)
        axes = [bool(np.any(absent[:, i] < _NO_AXIS_VARIANCE)) for i in range(3)]
        return ImuSeries(
            table.stamp_ns,
            table.received_ns,
            rate,
            force,
            (axes[0], axes[1], axes[2]),
            table.frame_id,
            tuple(table.column("angular_velocity_covariance")[0].tolist()),
            tuple(table.column("linear_acceleration_covariance")[0].tolist()),
            attitude(table),
        )

    def pose(self, name: str | None, imu: ImuSeries) -> PoseSeries | None:
        table = self._same_time(name, self._table(name), imu)
        return PoseSeries(table.stamp_ns, table.column("position")[:, 0].copy()) if table else None

    def joint(self, name: str | None, imu: ImuSeries) -> JointSeries | None:
        table = self._same_time(name, self._table(name), imu)
        if table is None:
            return None
        return JointSeries(table.stamp_ns, table.column("position"), table.column("velocity"), table.column("effort"))

    def current(self, name: str | None, imu: ImuSeries) -> ScalarSeries | None:
        try:
            table = self._same_time(name, self._table(name), imu)
        except BagError as error:  # the motor's current is welcome, not needed
            self.notes.append(str(error))
            return None
        return ScalarSeries(table.stamp_ns, table.column("current")) if table else None

    def scalar(self, name: str | None, column: str) -> ScalarSeries | None:
        table = self._table(name)
        if table is None:
            return None
        value = table.column(column)
        known = np.isfinite(value)
        if not known.all():
            self.notes.append(f"{name}: {int(np.sum(~known))} readings that are not numbers dropped")
        return ScalarSeries(table.stamp_ns[known], value[known]) if known.any() else None

    def mag(self, name: str | None) -> MagSeries | None:
        table = self._table(name)
        return MagSeries(table.stamp_ns, table.column("magnetic_field")) if table else None

    def reference(self, name: str | None) -> ReferencePose | None:
        table = self._table(name)
        if table is None:
            return None
        if "orientation_covariance" in table.columns:
            orientation = attitude(table)
            if orientation is None:
                raise BagError(f"{self.path}: {name} reports no orientation, so it is no reference")
            known = np.isfinite(orientation).all(axis=1)
            return ReferencePose(table.stamp_ns[known], np.full((int(known.sum()), 3), np.nan), orientation[known])
        orientation = table.column("orientation")[:, [3, 0, 1, 2]]  # ROS x, y, z, w -> w, x, y, z
        norm = np.linalg.norm(orientation, axis=1, keepdims=True)
        return ReferencePose(table.stamp_ns, table.column("position"), orientation / np.where(norm > 0, norm, np.nan))

    def link(self, name: str | None) -> tuple[LinkCounts | None, str | None]:
        topic = self.raw.get(name) if name else None
        if topic is None or not topic.payloads:
            return None, None
        payloads = topic.payloads
        if self.part is not None:
            payloads = [payloads[i] for i in self.part.rows(np.array(topic.received_ns, dtype=np.int64)).tolist()]
        if not payloads:
            return None, None
        try:
            messages = cdr.decode_link(payloads, topic.definition)
        except ValueError as error:
            self.notes.append(f"{name}: not used, {error}")
            return None, None
        unit = getattr(messages[-1], "unit_id", "") or None
        if len(messages) < 2:
            self.notes.append(f"{name}: a single message, so the losses within the bag are unknown")
            return None, unit
        return _link_counts(messages), unit

    def cut(self, name: str) -> None:
        """Where the host's clock was set in the midst of this topic, use the longest part alone, of all topics."""
        table = self._decoded(name)
        self.part = None if table is None else longest_part(table.stamp_ns, table.received_ns)
        if self.part is not None:
            self.notes.append(self.part.note)

    def _table(self, name: str | None) -> Table | None:
        """Decoded topic, sorted by stamp; None where it is absent or has no messages."""
        table = self._decoded(name)
        if table is None or name is None:
            return None
        if self.part is not None:
            rows = self.part.rows(table.received_ns)
            if not len(rows):
                return None
            table = table.take(rows)
        if np.any(
            np.diff(table.received_ns) < 0
        ):  # recorders may write out of order; what counts is the order of reception
            table = table.take(np.argsort(table.received_ns, kind="stable"))
        return self._in_order(name, table)

    def _decoded(self, name: str | None) -> Table | None:
        """Decoded topic in order of the file."""
        topic = self.raw.get(name) if name else None
        if topic is None or not topic.payloads:
            return None
        try:
            decoded = cdr.decode(topic.msgtype, topic.payloads)
        except ValueError as error:
            raise BagError(f"{self.path}: {name}: {error}; the recording is damaged") from error
        received = np.array(topic.received_ns, dtype=np.int64)
        return Table(decoded.stamp_ns, received, decoded.columns, decoded.frame_id)

    def _in_order(self, name: str, table: Table) -> Table:
        stamp, keep = table.stamp_ns, np.ones(len(table.stamp_ns), dtype=bool)
        unset = stamp == 0
        if unset.all():
            self.notes.append(f"{name}: no header stamps; the times of reception are used, which jitter")
            stamp = table.received_ns
        elif unset.any():
            self.notes.append(f"{name}: {int(unset.sum())} messages without a stamp dropped")
            keep = ~unset
        backwards = int(np.sum(np.diff(stamp[keep]) < 0))
        if backwards:
            self.notes.append(f"{name}: stamps went back {backwards} times; sorted by stamp")
        index = np.flatnonzero(keep)
        index = index[np.argsort(stamp[index], kind="stable")]
        first = np.concatenate(([True], np.diff(stamp[index]) > 0))
        repeated = int(np.sum(~first))
        if not first.all():
            self.notes.append(f"{name}: {repeated} repeated stamps; the first message of each is used")
            index = index[first]
        if name.endswith(_STEADY):
            self._note_gaps(name, stamp[index], repeated)
        if len(index) == len(stamp) and not backwards:
            return replace(table, stamp_ns=stamp)
        return replace(table, stamp_ns=stamp).take(index)

    def _note_gaps(self, name: str, stamp: NDArray[np.int64], repeated: int) -> None:
        gaps = find_gaps(stamp, repeated)
        if gaps.missing:
            self.notes.append(
                f"{name}: {gaps.missing} samples are missing in {gaps.count} gaps, the longest of {gaps.longest:.3f} s"
            )

    def _finite(self, name: str, table: Table) -> Table:
        """Without the samples that are not numbers, or no sensor's, in a field that they report."""
        good = np.ones(len(table.stamp_ns), dtype=bool)
        for quantity in ("angular_velocity", "linear_acceleration"):
            absent = table.column(f"{quantity}_covariance")[:, 0] == -1.0
            good &= absent | (np.abs(table.column(quantity)) < _BEYOND_SENSORS).all(axis=1)  # NaN compares false
        if good.all():
            return table
        if not good.any():
            raise BagError(f"{self.path}: {name} holds no sample that is a number; check the sensor")
        self.notes.append(f"{name}: {int(np.sum(~good))} samples that are not numbers of a sensor dropped")
        return table.take(np.flatnonzero(good))

    def _same_time(self, name: str | None, table: Table | None, imu: ImuSeries) -> Table | None:
        """The table, or None with a note where it shares no time with the IMU (another clock)."""
        if table is None:
            return None
        if table.stamp_ns[-1] < imu.stamp_ns[0] or table.stamp_ns[0] > imu.stamp_ns[-1]:
            self.notes.append(f"{name}: not used, its stamps share no time with the sensor's (another clock?)")
            return None
        return table


def _link_counts(messages: list[Any]) -> LinkCounts:
    """Differences summed message by message: a restart of the driver (counters from zero) loses nothing before it."""
    names = ("received", "lost", "corrupt", "duplicate", "reordered", "restarts")
    totals = dict.fromkeys(names, 0)
    for before, after in pairwise(messages):
        restarted = after.received < before.received
        for name in names:
            totals[name] += int(getattr(after, name)) - (0 if restarted else int(getattr(before, name)))
    return LinkCounts(**totals)
