"""The sensor's own fusion (BNO055 in NDOF mode, `<sensor>/imu/data`) as a filter like the others.

An attitude is two directions: where the sensor's up and its north are. The chip's readings come as these, in the places
of specific force and field, and are believed as they are (TRIAD: H. Black, "A passive system for determining the
attitude of a satellite", AIAA Journal 2(7), 1964); between two of them the gyro turns the attitude on. So the chip's
answer has a state that can be set, stands at the same samples as the other filters', and survives a gap in its topic.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import sqrt

import numpy as np
from scipy.spatial.transform import Rotation

from gsense_fusion.compiling import kernel

from .compiled import CompiledFilter, require_not_negative, unit_quaternion
from .interface import FloatArray
from .kernels import SIGNATURE_BATCH, SIGNATURE_FIELD, SIGNATURE_IMU, load, store, turn, vector


@dataclass(frozen=True)
class OwnParameters:
    """How the chip's readings are filled in."""

    follow_gyro: float = 1.0
    """Share of the gyro's rate between two readings: 1 turns the attitude on, 0 holds the newest reading."""

    def __post_init__(self) -> None:
        require_not_negative("own", follow_gyro=self.follow_gyro)


@dataclass
class OwnState:
    """What the filter remembers."""

    quaternion: FloatArray = field(default_factory=lambda: np.array([1.0, 0.0, 0.0, 0.0]))
    """Body -> ENU, (w, x, y, z), shape (4,)."""


_SHARE = 4


def directions(quaternion: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Up and north in the body of attitudes body -> ENU, (w, x, y, z), shape (n, 4): two arrays of shape (n, 3)."""
    known = np.isfinite(quaternion).all(axis=1)
    up, north = np.full((2, len(quaternion), 3), np.nan)
    if known.any():
        to_body = Rotation.from_quat(quaternion[known][:, [1, 2, 3, 0]]).inv()
        up[known], north[known] = to_body.apply([0.0, 0.0, 1.0]), to_body.apply([0.0, 1.0, 0.0])
    return up, north


@kernel("UniTuple(f8, 4)(UniTuple(f8, 3), UniTuple(f8, 3), UniTuple(f8, 4))", allocates=False)
def _triad(up, north, old):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Attitude with this up and, as far as it is horizontal, this north; `old` where they are none."""
    size = sqrt(up[0] * up[0] + up[1] * up[1] + up[2] * up[2])
    if not size > 0.0:
        return old
    u0, u1, u2 = up[0] / size, up[1] / size, up[2] / size
    e0, e1, e2 = north[1] * u2 - north[2] * u1, north[2] * u0 - north[0] * u2, north[0] * u1 - north[1] * u0
    size = sqrt(e0 * e0 + e1 * e1 + e2 * e2)
    if not size > 0.0:
        return old
    e0, e1, e2 = e0 / size, e1 / size, e2 / size
    n0, n1, n2 = u1 * e2 - u2 * e1, u2 * e0 - u0 * e2, u0 * e1 - u1 * e0
    # rows east, north, up are the matrix body -> ENU; the largest element first (S. Shepperd, 1978)
    if e0 + n1 + u2 > 0.0:
        w, x, y, z = 1.0 + e0 + n1 + u2, u1 - n2, e2 - u0, n0 - e1
    elif e0 >= n1 and e0 >= u2:
        w, x, y, z = u1 - n2, 1.0 + e0 - n1 - u2, e1 + n0, e2 + u0
    elif n1 >= u2:
        w, x, y, z = e2 - u0, e1 + n0, 1.0 - e0 + n1 - u2, n2 + u1
    else:
        w, x, y, z = n0 - e1, e2 + u0, n2 + u1, 1.0 - e0 - n1 + u2
    size = sqrt(w * w + x * x + y * y + z * z)
    return (w / size, x / size, y / size, z / size)


@kernel(SIGNATURE_IMU, allocates=False)
def _imu(m, dt, rate, _up):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    store(m, turn(load(m), m[_SHARE] * dt, vector(rate)))


@kernel(SIGNATURE_FIELD, allocates=False)
def _field(m, dt, rate, up, north):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    store(m, _triad(vector(up), vector(north), turn(load(m), m[_SHARE] * dt, vector(rate))))


@kernel(SIGNATURE_BATCH)
def _batch(m, dt, rate, up, north):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    out = np.empty((dt.shape[0], 4))
    q = load(m)
    for i in range(dt.shape[0]):
        q = turn(q, m[_SHARE] * dt[i], vector(rate[i]))
        if north.shape[0] > 0:
            q = _triad(vector(up[i]), vector(north[i]), q)
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = q
    store(m, q)
    return out


class Own(CompiledFilter):
    """The chip's attitude; up in the place of the specific force, north in that of the field."""

    name = "own"
    _imu = staticmethod(_imu)
    _field = staticmethod(_field)
    _batch = staticmethod(_batch)

    def __init__(self, parameters: OwnParameters | None = None, state: OwnState | None = None) -> None:
        super().__init__(np.zeros(5))
        self.parameters = parameters or OwnParameters()
        self._memory[_SHARE] = self.parameters.follow_gyro
        self.state = state or OwnState()

    @property
    def state(self) -> OwnState:
        """What the filter remembers, a copy."""
        return OwnState(self.quaternion)

    @state.setter
    def state(self, value: OwnState) -> None:
        self._memory[:4] = unit_quaternion(value.quaternion)
