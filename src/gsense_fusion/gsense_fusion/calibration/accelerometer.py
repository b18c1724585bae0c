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


def _distinct(poses: FloatArray) -> int:
    """Number of directions that differ: one that is repeated is no further one."""
    found: list[FloatArray] = []
    for pose in poses:
        if all(_angle(other, pose) >= DISTINCT_RAD for other in found):
            found.append(pose)
    return len(found)


def calibrate_accelerometer(poses: FloatArray, gravity: float = GRAVITY) -> AccelerometerCalibration | str:
    """Fit the poses' means (n, 3); words that say what is lacking where they do not determine it."""
    distinct = _distinct(poses)
    if distinct < POSES_FOR_SCALES:
        return f"{distinct} distinct still poses: {POSES_FOR_SCALES} are needed, all around the sphere"
    hole = largest_hole(poses / np.linalg.norm(poses, axis=1, keepdims=True))
    if hole > LARGEST_HOLE_RAD:
        return (
            f"no still pose within {np.degrees(hole):.0f} degrees of some direction "
            f"({np.degrees(LARGEST_HOLE_RAD):.0f} are allowed): put the board on all its sides"
        )
    kind = Shape.TRIANGULAR if distinct >= POSES_FOR_ALL else Shape.SCALES
    try:
        fit = fit_ellipsoid(poses, gravity, kind)
        if fit.direction_stderr > MAX_DIRECTION_STDERR and kind is Shape.TRIANGULAR:
            fit = fit_ellipsoid(poses, gravity, Shape.SCALES)
    except ValueError as error:
        return str(error)
    if fit.direction_stderr > MAX_DIRECTION_STDERR:
        return (
            f"the poses leave directions open by {np.degrees(fit.direction_stderr):.1f} degrees: hold the board stiller"
        )
    return AccelerometerCalibration(fit, distinct)


def _angle(a: FloatArray, b: FloatArray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))
