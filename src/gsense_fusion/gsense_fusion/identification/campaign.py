"""The runs of a campaign with their motion, mounting and delay: what every later step works on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import prev_fast_len

from gsense_fusion.identification.motion.carriage import CarriageMotion
from gsense_fusion.identification.motion.felt_harmonics import with_felt_orders
from gsense_fusion.identification.motion.felt_motion import with_felt_motion
from gsense_fusion.identification.motion.grouping import find_mountings
from gsense_fusion.identification.motion.mounting import (
    NOMINAL,
    Delay,
    Mounting,
    RunGeometry,
    common_delay,
    run_delays,
    run_geometry,
)
from gsense_fusion.identification.motion.narrow_filter import RunFelt, through_narrow_filter
from gsense_fusion.identification.motion.turned_delays import without_turns
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import BoolArray, FloatArray, Role

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
    felt = [
        RunFelt(with_felt_orders(motion, run, found.along, late), run, found.along, late)
        for run, motion, found, late in zip(runs, motions, geometry, delays, strict=True)
    ]
    moved = [
        with_felt_motion(motion, run, _along(mountings, number.get(i)), late)
        for i, (motion, run, late) in enumerate(zip(through_narrow_filter(felt), runs, delays, strict=True))
    ]
    data = []
    for i, (run, motion, found, late) in enumerate(zip(runs, motions, geometry, delays, strict=True)):
        if i in number:
            k = number[i]
            mounting = NOMINAL if k is None else mountings[k]
        else:  # a still pose held by nothing but the table: a mounting of its own
            mountings.append(_pose(found))
            k, mounting = len(mountings) - 1, mountings[-1]
        data.append(RunData(run, moved[i], found, mounting, k, _windows(run, motion, late), late))
    return Campaign(tuple(data), tuple(mountings), delay)


def _along(mountings: Sequence[Mounting], number: int | None) -> FloatArray | None:
    """The rail's direction in the mounting of that number, shape (3,); None where nothing tells it."""
    return None if number is None else mountings[number].along


def _pose(geometry: RunGeometry) -> Mounting:
    norm = float(np.linalg.norm(geometry.mean_force))
    return Mounting(geometry.mean_force / norm, None, norm)


def _windows(run: CleanRun, motion: CarriageMotion | None, delay: float) -> tuple[Window, ...]:
    """Steady motion (whole where it is not periodic) and rest, in the IMU's time."""
    if motion is None:
        return (Window(0, len(run), False),)
    whole = _whole_windows(run, motion, delay)
    known = run.valid if motion.harmonics is not None else run.valid & motion.heard_at(run.time - delay)
    return tuple(part for w in whole for part in _between_gaps(known, run.rate_hz, w))


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
