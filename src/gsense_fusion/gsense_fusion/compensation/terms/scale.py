"""The gyro's own scale and misalignment."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gsense_fusion.compensation.document import Matrix, Section
from gsense_fusion.compensation.terms.numbers import KIND_SCALE, FloatArray, as_row, floats


@dataclass(frozen=True)
class ScaleMisalignment:
    """The gyro shows (I + matrix) w: what is left of the rate at this place in the list is multiplied by its inverse.

    Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation, equation 4.17; with g_sensitivity it is
    the 18-element calibration. Only true rotations show it.
    """

    effect: ClassVar[str] = "scale_misalignment"
    unit: ClassVar[str] = "1"
    kind: ClassVar[int] = KIND_SCALE

    matrix: Matrix

    def __post_init__(self) -> None:
        if np.abs(np.array(self.matrix)).sum(axis=1).max() > 0.5:
            raise ValueError("scale_misalignment: errors of more than 50 % are none of scale or alignment")

    @staticmethod
    def parse(section: Section) -> ScaleMisalignment:
        """From its entry."""
        return ScaleMisalignment(section.matrix("matrix"))

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {"matrix": floats(self.matrix)}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        inverse = np.linalg.inv(np.eye(3) + np.array(self.matrix))
        return as_row(matrix=inverse)
