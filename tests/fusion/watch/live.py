"""A live stream made of the independent simulator's runs: something may enter in its middle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from tests.study.simulator.parameters import Disturbance, PlannedRun, SessionParameters
from tests.study.simulator.session import Session, simulate

from gsense_fusion.bags.run import Run
from gsense_fusion.compensation import CompensationFile, GSensitivity
from gsense_fusion.watch import Prediction, Watcher, WatchReport, WatchSettings

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shift:
    """A shift at the rig: what runs, and what enters when."""

    seed: int
    disturbance: Disturbance | None = None
    onset_s: float = 0.0
    frequencies: tuple[float, ...] = (4.0, 7.0)
    duration_s: float = 100.0
    rest_s: float = 30.0


@lru_cache(maxsize=4)
def session(shift: Shift, disturbed: bool) -> Session:
    """Rest, then motion, for each frequency; the same noise with and without the disturbance."""
    plan = [
        run
        for w in shift.frequencies
        for run in (PlannedRun(0.0, duration_s=shift.rest_s), PlannedRun(w, shift.duration_s))
    ]
    more = (shift.disturbance,) if disturbed and shift.disturbance else ()
    return simulate(SessionParameters(seed=shift.seed, plan=tuple(plan), disturbances=more))


def compensation(shift: Shift) -> CompensationFile:
    """The unit's G as a calibration would find it, from the accelerometer's readings, without noise."""
    made = session(shift, False)
    force = np.concatenate([run.imu.specific_force for run, _ in made.runs])
    columns = np.column_stack([np.ones(len(force)), force])
    rate = np.concatenate([truth.signal for truth in made.truth])
    g = np.linalg.lstsq(columns, rate, rcond=None)[0][1:].T
    rows = [tuple(float(x) for x in row) for row in g]
    return CompensationFile("mpu6050", terms=(GSensitivity(matrix=(rows[0], rows[1], rows[2])),))  # type: ignore[arg-type]


def watch(shift: Shift, settings: WatchSettings | None = None) -> Iterator[WatchReport]:
    """Every test's report of a watcher that sees the shift sample by sample."""
    prediction = Prediction(compensation(shift))
    watcher = Watcher(settings or WatchSettings())
    clean, disturbed = session(shift, False), session(shift, True)
    start = int(clean.runs[0][0].imu.stamp_ns[0])
    for (before, _), (after, _) in zip(clean.runs, disturbed.runs, strict=True):
        yield from _one_run(before, after, start, shift.onset_s, prediction, watcher)


def _one_run(
    before: Run, after: Run, start: int, onset: float, prediction: Prediction, watcher: Watcher
) -> Iterator[WatchReport]:
    assert before.pose is not None
    poses = zip(_seconds(before.pose.stamp_ns, start), before.pose.position.tolist(), strict=True)
    pose = next(poses, None)
    for i, t in enumerate(_seconds(before.imu.stamp_ns, start)):
        while pose is not None and pose[0] <= t:
            watcher.add_position(*pose)
            pose = next(poses, None)
        imu = after.imu if t >= onset else before.imu
        force = imu.specific_force[i]
        known = prediction.bias_from_rest
        residual = prediction.residual(int(imu.stamp_ns[i]), imu.angular_rate[i], force)
        if prediction.bias_from_rest != known:
            watcher.begin_anew(t)
        watcher.add_sample(t, residual, force)
        if watcher.due():
            yield watcher.test(watcher.window())


def _seconds(stamps: NDArray[np.int64], start: int) -> list[float]:
    return ((stamps - start) * 1e-9).tolist()


def first_alarm(reports: Sequence[WatchReport]) -> WatchReport | None:
    """The first report that raised something."""
    return next((report for report in reports if report.fresh), None)
