"""What every attitude filter offers.

Conventions of the whole package: quaternions are (w, x, y, z), unit, and turn vectors of the sensor's axes into the
earth frame, east-north-up (ENU, REP-103; north is magnetic north where a magnetometer is used). Specific force is +g on
the axis that points up at rest. The angular rate handed to a filter is free of its bias.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


class AttitudeFilter(Protocol):
    """One filter: its state can be read and set, so a run can be cut in two with the identical result."""

    @property
    def quaternion(self) -> FloatArray:
        """Attitude, body -> ENU, shape (4,), a copy."""

    @quaternion.setter
    def quaternion(self, value: FloatArray) -> None: ...

    def prepare(self, period_s: float, field_period_s: float | None) -> None:
        """Told before the first sample, from the first second: usual intervals of samples and fields (None: none), s.

        For filters whose coefficients rest on a fixed rate; intervals are still taken from the stamps.
        """

    def update(
        self, dt: float, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None = None
    ) -> FloatArray:
        """Take one sample.

        Args:
            dt: time since the sample before, s.
            angular_rate: rad/s, shape (3,).
            specific_force: m/s^2, shape (3,); not finite or zero: the gyro alone is used.
            field: magnetic field in any unit, shape (3,), or None where there is no new one.

        Returns:
            The attitude after the sample, shape (4,).
        """

    def batch(
        self, dt: FloatArray, angular_rate: FloatArray, specific_force: FloatArray, field: FloatArray | None = None
    ) -> FloatArray:
        """Take n samples, as n calls of `update` would.

        Args:
            dt: s, shape (n,).
            angular_rate: rad/s, shape (n, 3).
            specific_force: m/s^2, shape (n, 3).
            field: shape (n, 3), rows of NaN where there is no new one; or None.

        Returns:
            The attitude after each sample, shape (n, 4).
        """
