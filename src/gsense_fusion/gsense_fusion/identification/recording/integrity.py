"""The layer before any fit: uniform sample grid, losses, clipping, sessions.

Everything later works in the frequency domain and needs equidistant samples; a loss that is not seen here would look
like a phase effect there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from gsense_fusion.bags.run import Run, ScalarSeries
from gsense_fusion.identification.recording.field import FieldRecord, MotorRecord, field_record, motor_record
from gsense_fusion.identification.recording.lattice import lattice_steps
from gsense_fusion.identification.recording.several import runs_of
from gsense_fusion.identification.recording.stamps import Stamps, grid_index, look_at_stamps
from gsense_fusion.identification.recording.supply import supply_of
from gsense_fusion.identification.types import GRAVITY, BoolArray, FloatArray, IdentificationError, IntArray, Role

SESSION_GAP_S = 60.0
MIN_SAMPLES = 200
LONGEST_RAIL_M = 10.0
MIN_CLIPPED = 5
FULL_SCALES_DEG_S = (125.0, 250.0, 300.0, 500.0, 1000.0, 2000.0)
FULL_SCALES_G = (2.0, 4.0, 8.0, 16.0)
MIN_FLAT, FLAT_RATIO, FLAT_BAND, FLAT_LEVELS = 20, 5.0, 0.01, 50
"""A flat top: so many samples at the extreme value, so many times those in this part of the span beside it; and how
many steps of the lattice the span must have."""


@dataclass(frozen=True)
class Clipped:
    """An axis of a run that reached its full scale."""

    effect: str
    """gyro_clipping or accel_clipping."""
    axis: int
    level: float
    """rad/s or m/s^2, as `unit` says."""
    samples: int
    unit: str


@dataclass(frozen=True)
class CleanRun:
    """One run on a uniform grid; time in s since the campaign's first sample."""

    name: str
    path: str
    sensor: str
    role: Role
    session: int
    time: FloatArray
    """Shape (n,), equidistant."""
    rate_hz: float
    angular_rate: FloatArray
    """rad/s, shape (n, 3), sensor axes; lost samples interpolated, axes that do not exist zero."""
    specific_force: FloatArray
    """m/s^2, shape (n, 3), sensor axes; NaN where the sensor has no accelerometer."""
    valid: BoolArray
    """False where a sample was lost, shape (n,)."""
    axes: tuple[int, ...]
    """The gyro axes that exist."""
    lost: int
    received: int
    pose_time: FloatArray | None
    """Encoder stamps in s, shape (m,)."""
    pose: FloatArray | None
    """Carriage position in m, shape (m,)."""
    temperature: FloatArray | None
    """Die temperature on the grid in degrees Celsius, smoothed, shape (n,)."""
    unit_id: str | None = None
    notes: tuple[str, ...] = ()
    clipped: tuple[Clipped, ...] = ()
    supply: FloatArray | None = None
    """Supply voltage on the grid in V, running means over five readings, shape (n,)."""
    stamps: Stamps = field(default_factory=Stamps)
    """What is missing and what came twice."""
    steps: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the gyro's output, rad/s by axis; zero where its values lie on no lattice."""
    magnetic: FieldRecord | None = None
    """The magnetometer's messages."""
    motor: MotorRecord | None = None
    """What tells how hard the motor works."""

    def __len__(self) -> int:
        return len(self.time)

    @property
    def has_rig(self) -> bool:
        """Whether the encoder's position is known."""
        return self.pose is not None


def clean_runs(runs: Sequence[tuple[Run, Role]]) -> list[CleanRun]:
    """Put the runs on uniform grids and number their sessions, in order of time; a bag's motions are runs of their own.

    Raises:
        IdentificationError: A run is too short, or its stamps make no grid.

    """
    apart = [(part, role) for run, role in runs for part in runs_of(run)]
    ordered = sorted(apart, key=lambda item: int(item[0].imu.stamp_ns[0]) if len(item[0].imu) else 0)
    if not ordered:
        raise IdentificationError("no runs given: name at least one bag with --fit")
    epoch = int(ordered[0][0].imu.stamp_ns[0]) if len(ordered[0][0].imu) else 0
    out: list[CleanRun] = []
    session = 0
    for run, role in ordered:
        clean = _clean(run, role, epoch)
        if out and clean.time[0] - out[-1].time[-1] > SESSION_GAP_S:
            session += 1
        out.append(replace(clean, session=session))
    return out


def _grid(run: Run) -> tuple[IntArray, float]:
    """Place of each sample on a uniform grid, and its period (s); raises IdentificationError where there is none."""
    imu = run.imu
    if len(imu) < MIN_SAMPLES:
        raise IdentificationError(f"{run.path}: only {len(imu)} samples on {run.topic}; record at least {MIN_SAMPLES}")
    if run.encoder is not None:
        _check_encoder(run.path, run.encoder.position)
    index, period = grid_index(imu.stamp_ns)
    room = int(index[-1]) + 1
    if room > 3 * len(imu):
        raise IdentificationError(
            f"{run.path}: {run.topic} has {len(imu)} samples where its stamps make room for {room}; "
            "the stamps are not those of one steady stream"
        )
    return index, period


def _clean(run: Run, role: Role, epoch_ns: int) -> CleanRun:
    imu, encoder = run.imu, run.encoder
    index, period = _grid(run)
    n = int(index[-1]) + 1
    offset = _grid_offset(imu.stamp_ns, index, period)
    stamps = (imu.stamp_ns - epoch_ns) * 1e-9
    time = (stamps[0] + offset) + np.arange(n) * period
    valid = np.zeros(n, dtype=bool)
    valid[index] = True
    axes = tuple(i for i in range(3) if imu.rate_axes[i] and np.isfinite(imu.angular_rate[:, i]).all())
    if not axes:
        raise IdentificationError(f"{run.path}: {run.topic} reports no angular rate")
    rate, force = _on_grid(run, axes, index, time, epoch_ns)
    return CleanRun(
        name=run.name,
        path=str(run.path),
        sensor=run.sensor,
        role=role,
        session=0,
        time=time,
        rate_hz=1.0 / period,
        angular_rate=rate,
        specific_force=force,
        valid=valid,
        axes=axes,
        lost=n - len(imu),
        received=len(imu),
        pose_time=None if encoder is None else (encoder.stamp_ns - epoch_ns) * 1e-9,
        pose=None if encoder is None else encoder.position,
        temperature=_smooth(run.temperature, epoch_ns, time),
        unit_id=run.unit_id,
        notes=run.notes,
        clipped=clipped(imu.angular_rate, imu.specific_force, axes),
        supply=supply_of(run.battery, epoch_ns, time),
        stamps=look_at_stamps(index, period, np.concatenate([imu.angular_rate, imu.specific_force], axis=1), run.link),
        steps=lattice_steps(imu.angular_rate, axes),
        magnetic=field_record(run, epoch_ns),
        motor=motor_record(run, epoch_ns),
    )


def _on_grid(
    run: Run, axes: tuple[int, ...], index: IntArray, time: FloatArray, epoch_ns: int
) -> tuple[FloatArray, FloatArray]:
    """Angular rate (zero on axes that are not there) and specific force at the grid's times, shape (n, 3) each."""
    imu, beside, grid = run.imu, run.beside, np.arange(len(time))
    rate = np.zeros((len(time), 3))
    force = np.empty((len(time), 3))
    for axis in range(3):
        if axis in axes:
            rate[:, axis] = np.interp(grid, index, imu.angular_rate[:, axis])
        if beside is None:
            force[:, axis] = np.interp(grid, index, imu.specific_force[:, axis])
        else:  # a board's accelerometer feels for all its gyros
            force[:, axis] = np.interp(time, (beside.stamp_ns - epoch_ns) * 1e-9, beside.specific_force[:, axis])
    return rate, force


def _check_encoder(path: Path, position: FloatArray) -> None:
    if len(position) < MIN_SAMPLES:
        raise IdentificationError(f"{path}: only {len(position)} encoder positions on rig/*; record the whole run")
    if not np.isfinite(position).all() or float(np.ptp(position)) > LONGEST_RAIL_M:
        raise IdentificationError(
            f"{path}: the encoder's positions span {np.ptp(position):.3g} m, no carriage on a rail does; "
            "rig/pose's position.x and rig/joint_states' position are in metres"
        )


def _grid_offset(stamp_ns: IntArray, index: IntArray, period: float) -> float:
    """Mean of stamp minus grid in s: the jitter of one stamp must not shift the whole run."""
    return float(np.mean((stamp_ns - stamp_ns[0]) * 1e-9 - index * period))


def _smooth(series: ScalarSeries | None, epoch_ns: int, time: FloatArray) -> FloatArray | None:
    """A cubic in time per run: the die's heat capacity makes it slow, and raw noise would lose to 'drift'."""
    if series is None or len(series.stamp_ns) < 4:
        return None
    stamps = (series.stamp_ns - epoch_ns) * 1e-9
    middle, half = float(time.mean()), max(float(np.ptp(time)) / 2, 1e-3)
    order = 3 if len(stamps) >= 40 else 1
    fit = np.polynomial.Polynomial.fit(stamps, series.value, order, domain=[middle - half, middle + half])
    return np.asarray(fit(time), dtype=float)


def clipped(rate: FloatArray, force: FloatArray, axes: tuple[int, ...]) -> tuple[Clipped, ...]:
    """Axes whose extreme value is a full scale and is reached again and again, or is a flat top at any level.

    An axis of the gyro that stands still while noise moves the others lies beyond its range with its bias alone.
    """
    looks = [("gyro_clipping", i, rate[:, i], np.radians(FULL_SCALES_DEG_S), "rad/s") for i in axes]
    looks += [("accel_clipping", i, force[:, i], GRAVITY * np.array(FULL_SCALES_G), "m/s^2") for i in range(3)]
    out = []
    for effect, axis, series, scales, unit in looks:
        if not np.isfinite(series).all():
            continue
        peak = float(np.max(np.abs(series)))
        samples = int(np.sum(np.abs(series) >= peak * (1 - 1e-9)))
        if samples >= MIN_CLIPPED and np.any(np.abs(peak / scales - 1.0) < 0.01):
            out.append(Clipped(effect, axis, peak, samples, unit))
            continue
        stuck = effect == "gyro_clipping" and peak > 0.0 and np.ptp(series) == 0.0
        if stuck and _restless(rate[:, [i for i in axes if i != axis]]):
            out.append(Clipped(effect, axis, peak, len(series), unit))
            continue
        flat = [(abs(float(s.max())), n) for s in (series, -series) if (n := _flat_top(s))]
        if flat:
            out.append(Clipped(effect, axis, max(x for x, _ in flat), sum(n for _, n in flat), unit))
    return tuple(out)


def _restless(others: FloatArray) -> bool:
    """Whether noise moves another axis (n, k) at most samples: a step so fine holds no axis at one value."""
    return len(others) >= MIN_FLAT and bool(np.any(np.mean(np.diff(others, axis=0) != 0.0, axis=0) > 0.5))


def _flat_top(series: FloatArray) -> int:
    """Samples at the largest value where they pile up there, else 0: noise thins out to its end, and so does a sine's.

    A noiseless sine has up to 2.4 times as many values in its topmost step as in the next one.
    """
    top, span = float(series.max()), float(np.ptp(series))
    at = series >= top - 1e-9 * span
    samples = int(at.sum())
    if samples < MIN_FLAT or samples == len(series):
        return 0
    step = top - float(series[~at].max())
    if step > span / FLAT_LEVELS:  # a coarse lattice has many values at its last step
        return 0
    beside = int(np.sum(~at & (series >= top - max(step * (1 + 1e-6), FLAT_BAND * span))))
    return samples if samples > FLAT_RATIO * beside else 0
