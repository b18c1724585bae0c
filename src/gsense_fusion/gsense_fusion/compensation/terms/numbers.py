"""The row of numbers that the kernel works on, and plain numbers for the file."""

from __future__ import annotations

from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gsense_fusion.compensation.document import Matrix, Section, Vector

FloatArray = NDArray[np.float64]
ROW = 16
"""Numbers of one term: 9 matrix (or c and its rate or higher order), 3 direction, reference, lag or f0 or inertia,
damping, spare."""
KIND_FORCE, KIND_SQUARE, KIND_CUBE, KIND_JERK, KIND_RESONANCE = 0, 1, 2, 3, 4
KIND_TEMPERATURE, KIND_SUPPLY, KIND_FRICTION, KIND_SPEED, KIND_SCALE = 5, 6, 7, 8, 9


def floats(values: Any) -> Any:
    """Numbers, or rows of them, as plain floats.

    Raises:
        ValueError: one is not finite.
    """
    return [floats(value) if isinstance(value, (tuple, list)) else finite(value) for value in values]


def finite(value: Any) -> float:
    """A plain float (numpy's are no YAML).

    Raises:
        ValueError: it is not finite.
    """
    value = float(value)
    if not isfinite(value):
        raise ValueError(f"a compensation file cannot hold {value}")
    return value


def unit_direction(section: Section) -> Vector:
    """The entry's `direction`.

    Raises:
        ValueError: it has not length 1.
    """
    x, y, z = section.vector("direction")
    length = (x * x + y * y + z * z) ** 0.5
    if abs(length - 1.0) > 1e-3:
        raise ValueError(f"{section.path}direction: a unit vector is needed, this one has length {length:g}")
    return (x, y, z)


def as_row(
    matrix: Matrix | FloatArray | None = None,
    c: Vector | None = None,
    rate: Vector | None = None,
    direction: Vector | None = None,
    reference: float = 0.0,
    lag: float = 0.0,
    damping: float = 0.0,
) -> FloatArray:
    """The numbers of a term for the kernel, shape (ROW,)."""
    row = np.zeros(ROW)
    if matrix is not None:
        row[:9] = np.array(matrix, dtype=np.float64).ravel()
    elif c is not None:
        row[:3] = c
        row[3:6] = rate or 0.0
    if direction is not None:
        row[9:12] = direction
    row[12:15] = reference, lag, damping
    row[15] = 1.0 if direction is not None else 0.0
    return row
