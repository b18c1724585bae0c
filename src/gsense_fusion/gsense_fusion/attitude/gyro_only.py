"""The gyro alone: what drift and g-sensitivity do to an attitude that nothing corrects.

Thesis, equation 4.11, solved exactly for the constant rate of each interval.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gsense_fusion.compiling import kernel

from .compiled import CompiledFilter, unit_quaternion
from .interface import FloatArray
from .kernels import SIGNATURE_BATCH, SIGNATURE_FIELD, SIGNATURE_IMU, load, store, turn, vector


@dataclass(frozen=True)
class GyroOnlyParameters:
    """There are none."""


@dataclass
class GyroOnlyState:
    """What the filter remembers."""

    quaternion: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Body -> ENU, (w, x, y, z), shape (4,)."""


@kernel(SIGNATURE_IMU, allocates=False)
def _imu(m, dt, rate, _force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    store(m, turn(load(m), dt, vector(rate)))


@kernel(SIGNATURE_FIELD, allocates=False)
def _field(m, dt, rate, _force, _mag):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    store(m, turn(load(m), dt, vector(rate)))


@kernel(SIGNATURE_BATCH)
def _batch(m, dt, rate, _force, _mag):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    out = np.empty((dt.shape[0], 4))
    q = load(m)
    for i in range(dt.shape[0]):
        q = turn(q, dt[i], vector(rate[i]))
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = q
    store(m, q)
    return out


class GyroOnly(CompiledFilter):
    """Integrates the rate; accelerometer and magnetometer only give the start."""

    name = "gyro_only"
    _imu = staticmethod(_imu)
    _field = staticmethod(_field)
    _batch = staticmethod(_batch)

    def __init__(self, parameters: GyroOnlyParameters | None = None, state: GyroOnlyState | None = None) -> None:
        super().__init__(np.zeros(4))
        self.parameters = parameters or GyroOnlyParameters()
        self.state = state or GyroOnlyState()

    @property
    def state(self) -> GyroOnlyState:
        """What the filter remembers, a copy."""
        return GyroOnlyState(self.quaternion)

    @state.setter
    def state(self, value: GyroOnlyState) -> None:
        self._memory[:4] = unit_quaternion(value.quaternion)
