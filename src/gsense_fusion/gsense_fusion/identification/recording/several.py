"""A campaign that was recorded into one bag: each of its motions is a run of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from itertools import pairwise
from typing import Any

import numpy as np

from gsense_fusion.bags.run import PoseSeries, Run
from gsense_fusion.identification.motion.carriage import Interval, moving_stretches, without_dwells

MIN_MOTION_S = 8.0
"""A motion that counts: shorter ones are moves to a start."""
PAUSE_S = 0.5
"""The recorder's pause; in a shorter one samples were lost."""


def runs_of(run: Run) -> list[Run]:
    """The run itself, or where its carriage moves more than once, a run for each motion with the rest around it."""
    encoder = run.encoder
    if encoder is None or len(encoder.position) < 2 or not len(run.imu) or not np.isfinite(encoder.position).all():
        return [run]
    start = int(encoder.stamp_ns[0])
    motions = _motions(moving_stretches((encoder.stamp_ns - start) * 1e-9, encoder.position))
    if len(motions) < 2:
        return [run]
    cuts = [start + _cut_ns(encoder, start, a.stop, b.start) for a, b in pairwise(motions)]
    edges = [np.iinfo(np.int64).min, *cuts, np.iinfo(np.int64).max]
    parts = [_part(run, low, high, k) for k, (low, high) in enumerate(pairwise(edges))]
    told = f"{run.name}: {len(parts)} motions in one bag; each is a run of its own"
    return [replace(parts[0], notes=(*run.notes, told)), *parts[1:]]


def _motions(stretches: Sequence[Interval]) -> list[Interval]:
    """Stretches with less than a rest between them, joined, as far as they last."""
    return [m for m in without_dwells(stretches) if m.duration >= MIN_MOTION_S]


def _cut_ns(encoder: PoseSeries, start_ns: int, low: float, high: float) -> int:
    """In ns after the start, between two times in s: within the recorder's pause where it made one, else half-way."""
    time = (encoder.stamp_ns - start_ns) * 1e-9
    between = np.concatenate([[low], time[(time > low) & (time < high)], [high]])
    longest = int(np.argmax(np.diff(between)))
    a, b = (low, high) if between[longest + 1] - between[longest] < PAUSE_S else between[longest : longest + 2]
    return int((a + b) / 2 * 1e9)


def _part(run: Run, low_ns: int, high_ns: int, number: int) -> Run:
    """What is stamped from one instant to the other (exclusive); the link's counts, which have no times, go first."""
    series = {f.name: getattr(run, f.name) for f in fields(run) if hasattr(getattr(run, f.name), "stamp_ns")}
    cut = {name: _within(value, low_ns, high_ns) for name, value in series.items()}
    return replace(run, name=f"{run.name} run {number + 1}", notes=(), link=None if number else run.link, **cut)


def _within(series: Any, low_ns: int, high_ns: int) -> Any:
    """A series of a run between the instants."""
    kept = slice(*np.searchsorted(series.stamp_ns, (low_ns, high_ns)))
    arrays = {f.name: getattr(series, f.name) for f in fields(series)}
    return replace(series, **{name: a[kept] for name, a in arrays.items() if isinstance(a, np.ndarray)})
