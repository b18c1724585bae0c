"""Block means of the runs: whole drive periods in motion, eight seconds at rest."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from gsense_fusion.identification.campaign import RunData, Window
from gsense_fusion.identification.likelihood.slow import Blocks

BLOCK_S = 8.0

Cut = tuple[int, Window]
"""Number of the run and samples of one block."""


def cut_blocks(runs: Sequence[RunData]) -> list[Cut]:
    """Cut the runs' windows into blocks, in order of time; blocks of moving windows hold whole periods."""
    out: list[Cut] = []
    for number, data in enumerate(runs):
        for window in sorted(data.windows, key=lambda w: w.start):
            out.extend((number, w) for w in _cut_window(data, window))
    return out


def _cut_window(data: RunData, window: Window) -> list[Window]:
    rate = data.run.rate_hz
    unit = BLOCK_S
    if window.moving and data.motion is not None and data.motion.angular_frequency is not None:
        period = 2 * np.pi / data.motion.angular_frequency
        unit = period * max(1, round(BLOCK_S / period))
    count = max(1, int(len(window) / rate / unit + 0.05)) if window.moving else max(1, round(len(window) / rate / unit))
    length = unit * rate if window.moving else len(window) / count
    edges = window.start + np.rint(np.arange(count + 1) * length).astype(int)
    edges = np.minimum(edges, window.stop)
    return [Window(int(a), int(b), window.moving) for a, b in itertools.pairwise(edges) if b > a]


def block_means(runs: Sequence[RunData], cuts: Sequence[Cut]) -> Blocks:
    """Mean rate of each block."""
    rate = np.array([runs[r].run.angular_rate[w.start : w.stop].mean(axis=0) for r, w in cuts]).reshape(-1, 3)
    time = np.array([runs[r].run.time[w.start : w.stop].mean() for r, w in cuts])
    duration = np.array([len(w) / runs[r].run.rate_hz for r, w in cuts])
    session = np.array([runs[r].run.session for r, _ in cuts], dtype=np.int64)
    run = np.array([r for r, _ in cuts], dtype=np.int64)
    pose = np.array(
        [-1 if runs[r].mounting_number is None else runs[r].mounting_number for r, _ in cuts], dtype=np.int64
    )
    return Blocks(time, duration, rate, session, run, pose)
