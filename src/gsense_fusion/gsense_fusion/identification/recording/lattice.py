"""The step of a sensor's output, from the values themselves."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.types import FloatArray

OFF_LATTICE = 0.05
"""Of a step: what rounding errors of the scale may leave."""
FEWEST_VALUES = 3


def lattice_step(values: FloatArray) -> float:
    """Distance of the values that a series can take, in its unit; zero where they lie on no lattice.

    Args:
        values: Shape (n,).

    """
    distinct = np.unique(values)
    if len(distinct) < FEWEST_VALUES:
        return float(distinct[-1] - distinct[0]) if len(distinct) == 2 else 0.0
    apart = np.diff(distinct)
    apart = apart[apart > 1e-9 * float(np.max(np.abs(distinct)))]
    smallest = float(apart.min())
    count = np.rint(apart / smallest)
    step = float(apart.sum() / count.sum())
    off = np.abs(apart / step - np.rint(apart / step))
    return step if float(np.quantile(off, 0.9)) < OFF_LATTICE else 0.0


def lattice_steps(rate: FloatArray, axes: tuple[int, ...]) -> tuple[float, float, float]:
    """The same for the axes of a gyro that exist, rad/s; `rate` has shape (n, 3)."""
    x, y, z = (lattice_step(rate[:, i]) if i in axes else 0.0 for i in range(3))
    return x, y, z
