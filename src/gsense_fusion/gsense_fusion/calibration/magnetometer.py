"""Hard and soft iron of the magnetometer from the field while the board is turned in all directions.

The corrected field has one strength. Its value is not seen: the mean strength of the given or fitted ellipsoid is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gsense_fusion.compensation import MagnetometerCorrection, Matrix

from .ellipsoid import EllipsoidFit, FloatArray, Shape, fit_ellipsoid, largest_hole

LARGEST_HOLE_RAD = np.radians(50.0)
MAX_DIRECTION_STDERR = np.radians(2.0)
MIN_SAMPLES = 60
CELL_RAD = 0.12
"""Samples in one direction within this count as one: a board that lies still proves nothing by repeating itself."""
REPEATS = 25
"""More samples than this in one direction weigh no more: then the field's own changes are larger than the noise."""
OUTLIER_MADS = 5.0


@dataclass(frozen=True)
class MagnetometerCalibration:
    """corrected = shape (B - offset), of the strength `field`."""

    fit: EllipsoidFit
    samples: int
    directions: int
    field: float
    """T."""
    spread_before: float
    spread_after: float
    """Standard deviation of the strength over its mean, without and with the correction."""

    @property
    def correction(self) -> MagnetometerCorrection:
        """As the compensation file holds it."""
        rows: Matrix = tuple(tuple(float(x) for x in row) for row in self.fit.shape)  # type: ignore[assignment]
        x, y, z = (float(v) for v in self.fit.offset)
        return MagnetometerCorrection((x, y, z), rows)


def calibrate_magnetometer(field: FloatArray) -> MagnetometerCalibration | str:
    """Fit samples of the field (n, 3) in T; words that say what is lacking where they do not determine it."""
    field = field[np.isfinite(field).all(axis=1)]
    if len(field) < MIN_SAMPLES:
        return f"{len(field)} samples of the field: at least {MIN_SAMPLES} are needed"
    means, weight = _one_each_direction(field)
    try:
        means, fit = _without_outliers(means, weight)
    except ValueError as error:
        return f"{error}: turn the board slowly through all directions"
    corrected = fit.apply(means)
    hole = largest_hole(corrected / np.linalg.norm(corrected, axis=1, keepdims=True))
    if hole > LARGEST_HOLE_RAD:
        far, limit = np.degrees(hole), np.degrees(LARGEST_HOLE_RAD)
        return (
            f"the field was not seen within {far:.0f} degrees of some direction ({limit:.0f} are allowed): "
            "turn the board slowly through all directions"
        )
    if fit.direction_stderr > MAX_DIRECTION_STDERR:
        off, limit = np.degrees(fit.direction_stderr), np.degrees(MAX_DIRECTION_STDERR)
        scatter = 100 * fit.residual_rms / float(np.mean(np.linalg.norm(corrected, axis=1)))
        return (
            f"the corrected field would be open by {off:.1f} degrees in some direction ({limit:.0f} are allowed; its "
            f"strength scatters by {scatter:.1f} %): turn the board in one place, away from iron"
        )
    before, after = np.linalg.norm(field, axis=1), np.linalg.norm(fit.apply(field), axis=1)
    return MagnetometerCalibration(
        fit=fit,
        samples=len(field),
        directions=len(means),
        field=float(np.mean(np.linalg.norm(corrected, axis=1))),
        spread_before=float(np.std(before) / np.mean(before)),
        spread_after=float(np.std(after) / np.mean(after)),
    )


def _without_outliers(means: FloatArray, weight: FloatArray) -> tuple[FloatArray, EllipsoidFit]:
    """Fit twice: iron that came near for a moment is left out the second time."""
    fit = _fit(means, weight)
    off = np.linalg.norm(fit.apply(means), axis=1)
    off = (off - np.median(off)) * weight
    good = np.abs(off) <= OUTLIER_MADS * 1.4826 * np.median(np.abs(off))
    if good.all() or good.sum() < 12:
        return means, fit
    return means[good], _fit(means[good], weight[good])


def _fit(means: FloatArray, weight: FloatArray) -> EllipsoidFit:
    """Symmetric shape of mean scale one: the strength of the field is kept."""
    length = float(np.median(np.linalg.norm(means - means.mean(axis=0), axis=1)))
    fit = fit_ellipsoid(means, length, Shape.SYMMETRIC, weight)
    scale = float(np.cbrt(np.linalg.det(fit.shape)))
    return EllipsoidFit(
        fit.offset,
        fit.offset_stderr,
        fit.shape / scale,
        fit.shape_stderr / scale,
        fit.residual_rms / scale,
        fit.direction_stderr,
    )


def _one_each_direction(field: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Means over cells of direction seen from the middle of the data, shape (m, 3), and their weights, shape (m,)."""
    middle = (field.max(axis=0) + field.min(axis=0)) / 2
    u = field - middle
    strength = np.maximum(np.linalg.norm(u, axis=1), 1e-12)
    u = u / strength[:, None]
    cell = np.unique(np.rint(u / CELL_RAD).astype(np.int64), axis=0, return_inverse=True)[1].ravel()
    direction = np.stack([np.bincount(cell, weights=u[:, i]) for i in range(3)], axis=1)
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    direction = direction / np.maximum(length, 1e-12)  # the mean of vectors in a cell would be too short
    count = np.bincount(cell)
    mean = np.bincount(cell, weights=strength) / count
    return np.asarray(middle + direction * mean[:, None]), np.sqrt(np.minimum(count, REPEATS))
