"""Scale, misalignment and bias of the accelerometer from gravity in still poses.

The poses' mean specific force has the length of gravity. Nine parameters where the poses cover the sphere; scales and
bias alone where they are few; else nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gsense_fusion.compensation import AccelerometerCorrection, Matrix
from gsense_fusion.identification.campaign import RunData
from gsense_fusion.identification.types import GRAVITY

from .ellipsoid import EllipsoidFit, FloatArray, Shape, fit_ellipsoid, largest_hole

LARGEST_HOLE_RAD = np.radians(75.0)
MAX_DIRECTION_STDERR = np.radians(1.0)
DISTINCT_RAD = 0.17
POSES_FOR_ALL = 10
POSES_FOR_SCALES = 8


@dataclass(frozen=True)
class AccelerometerCalibration:
    """corrected = shape (f - offset)."""

    fit: EllipsoidFit
    poses: int

    @property
    def correction(self) -> AccelerometerCorrection:
        """As the compensation file holds it."""
        rows: Matrix = tuple(tuple(float(x) for x in row) for row in self.fit.shape)  # type: ignore[assignment]
        x, y, z = (float(v) for v in self.fit.offset)
        return AccelerometerCorrection(rows, (x, y, z))


def pose_means(runs: Sequence[RunData]) -> FloatArray:
    """Mean specific force of every still stretch, m/s^2, shape (n, 3)."""
    means = [
        data.run.specific_force[w.start : w.stop].mean(axis=0) for data in runs for w in data.windows if not w.moving
    ]
    poses = np.array(means).reshape(-1, 3)
    return np.asarray(poses[np.isfinite(poses).all(axis=1)])


def _groups(poses: FloatArray) -> list[list[int]]:
    """Numbers of the poses that lie together: one direction repeated is no further direction."""
    found: list[list[int]] = []
    for i, pose in enumerate(poses):
        near = next((g for g in found if _angle(poses[g[0]], pose) < DISTINCT_RAD), None)
        if near is None:
            found.append([i])
        else:
            near.append(i)
    return found


def calibrate_accelerometer(poses: FloatArray, gravity: float = GRAVITY) -> AccelerometerCalibration | str:
    """Fit the poses' means (n, 3); words that say what is lacking where they do not determine it."""
    groups = _groups(poses)
    if len(groups) < POSES_FOR_SCALES:
        return f"{len(groups)} distinct still poses: {POSES_FOR_SCALES} are needed, all around the sphere"
    hole = largest_hole(poses / np.linalg.norm(poses, axis=1, keepdims=True))
    if hole > LARGEST_HOLE_RAD:
        return (
            f"no still pose within {np.degrees(hole):.0f} degrees of some direction "
            f"({np.degrees(LARGEST_HOLE_RAD):.0f} are allowed): put the board on all its sides"
        )
    kind = Shape.TRIANGULAR if len(groups) >= POSES_FOR_ALL else Shape.SCALES
    weight = np.ones(len(poses))
    for group in groups:
        weight[group] = 1.0 / np.sqrt(len(group))
    try:
        fit = fit_ellipsoid(poses, gravity, kind, weight)
        if fit.direction_stderr > MAX_DIRECTION_STDERR and kind is Shape.TRIANGULAR:
            fit = fit_ellipsoid(poses, gravity, Shape.SCALES, weight)
    except ValueError as error:
        return str(error)
    if fit.direction_stderr > MAX_DIRECTION_STDERR:
        return (
            f"the poses leave directions open by {np.degrees(fit.direction_stderr):.1f} degrees: hold the board stiller"
        )
    return AccelerometerCalibration(fit, len(groups))


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
