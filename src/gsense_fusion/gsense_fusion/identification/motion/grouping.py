"""Which runs share a mounting: by gravity, and by the direction of the rail where they move."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gsense_fusion.identification.motion.mounting import STEADY_ENOUGH, Heading, Mounting, RunGeometry
from gsense_fusion.identification.types import FloatArray

SAME_MOUNTING_RAD = 0.14
"""Two runs whose gravity and rail directions differ by less (8 degrees) are one mounting."""
SAME_GRAVITY_RAD = 3e-3
"""Directions of gravity that differ by less may be one: a rail's bow, the accelerometer's bias as it warms."""


@dataclass
class _Cluster:
    up: list[FloatArray] = field(default_factory=list)
    norm: list[float] = field(default_factory=list)
    along: list[tuple[FloatArray, float]] = field(default_factory=list)
    """Of the steady sines, with their weights."""
    along_stderr: list[float] = field(default_factory=list)
    headings: list[Heading] = field(default_factory=list)


def find_mountings(geometry: Sequence[RunGeometry]) -> tuple[list[Mounting], list[int | None]]:
    """Group the runs by mounting.

    Args:
        geometry: Of the runs, in order of time.

    Returns:
        The mountings and, for each run, the number of its mounting (None where the sensor has no accelerometer).

    """
    clusters: list[_Cluster] = []
    member: list[int | None] = [None] * len(geometry)
    # runs that move first, and of these the ones that are known best
    order = sorted(range(len(geometry)), key=lambda i: (geometry[i].along is None, geometry[i].heading is None))
    for i in order:
        g = geometry[i]
        norm = float(np.linalg.norm(g.mean_force))
        if not np.isfinite(norm) or norm < 1.0:
            continue
        up = g.mean_force / norm
        along = None if g.along is None else g.along / np.linalg.norm(g.along)
        fitting = [k for k, c in enumerate(clusters) if _fits(c, up, along, g.heading)]
        number = fitting[0] if fitting else None
        if len(fitting) > 1 and along is None and g.heading is None:
            number = _of_rest(i, up, {k: clusters[k] for k in fitting}, member)
        if number is None:
            clusters.append(_Cluster())
            number = len(clusters) - 1
        cluster = clusters[number]
        cluster.up.append(up)
        cluster.norm.append(norm)
        if along is not None and g.delay is not None:
            cluster.along.append((along, 1.0 / g.delay.stderr**2))
            cluster.along_stderr.append(g.along_stderr)
        elif g.heading is not None:
            cluster.headings.append(g.heading)
        member[i] = number
    return [_mounting(c) for c in clusters], member


def _of_rest(run: int, up: FloatArray, fitting: Mapping[int, _Cluster], member: Sequence[int | None]) -> int:
    """Mounting of a run that only rests: a board that is not quite level shows how it is turned, else the time does."""
    away = {k: _angle(np.mean(c.up, axis=0), up) for k, c in fitting.items()}
    alike = [k for k in fitting if away[k] < min(away.values()) + SAME_GRAVITY_RAD]
    return min(alike, key=lambda k: min(abs(i - run) for i, other in enumerate(member) if other == k))


def _fits(cluster: _Cluster, up: FloatArray, along: FloatArray | None, heading: Heading | None) -> bool:
    if _angle(np.mean(cluster.up, axis=0), up) > SAME_MOUNTING_RAD:
        return False
    known = _along(cluster)
    if known is None or (along is None and heading is None):
        return True
    if along is not None:
        return _angle(known, along) < SAME_MOUNTING_RAD
    assert heading is not None  # noqa: S101 # for mypy
    return _angle(known, heading.along) < SAME_MOUNTING_RAD + 3.0 * heading.stderr


def _along(cluster: _Cluster) -> FloatArray | None:
    """The rail's direction in a cluster's runs; not of unit length.

    The steady sines tell it, unless all of them are slow: then what moves faster (a drive that jitters) does.
    """
    others = [h.stderr for h in cluster.headings]
    if cluster.along and not _together(others) < STEADY_ENOUGH * _together(cluster.along_stderr):
        return np.asarray(np.average([a for a, _ in cluster.along], axis=0, weights=[w for _, w in cluster.along]))
    if cluster.headings:
        weights = [1.0 / stderr**2 for stderr in others]
        return np.asarray(np.average([h.along for h in cluster.headings], axis=0, weights=weights))
    return None


def _together(stderr: Sequence[float]) -> float:
    """Standard error of the weighted mean of values with these; infinite without any."""
    return float(1.0 / np.sqrt(np.sum(np.array(stderr) ** -2.0))) if len(stderr) else float("inf")


def _mounting(cluster: _Cluster) -> Mounting:
    up = np.mean(cluster.up, axis=0)
    along = _along(cluster)
    along = None if along is None else along / np.linalg.norm(along)
    return Mounting(up / np.linalg.norm(up), along, float(np.mean(cluster.norm)))


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
