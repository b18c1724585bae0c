"""The BNO055's own fusion (mode NDOF), as far as it can be simulated.

Bosch does not publish its algorithm. This stand-in is what its data sheet (BST-BNO055-DS000, 3.3 and 3.6.5) tells of
the outputs: an attitude of 9 axes every 10 ms in steps of 1/16384, gravity followed slowly and not at all while the
specific force is far from gravity, north from the magnetometer. It shows what a chip's attitude looks like beside
other filters; how good the real chip's is, it cannot show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]
LSB = 1.0 / 16384.0
"""Of a quaternion's element (data sheet, 3.6.5.5)."""


@dataclass(frozen=True)
class NdofParameters:
    """Time constants and limits."""

    tilt_tau_s: float = 4.0
    heading_tau_s: float = 8.0
    gate: float = 1.0
    """m/s^2: farther from 9.81 the specific force says nothing."""
    bias_tau_s: float = 30.0
    """s: how slowly the gyro's bias is learnt from what gravity corrects."""
    settle_s: float = 1.0
    """s: at first the time constants grow from nothing to their values."""


def ndof(stamp: Array, rate: Array, force: Array, field: Array, parameters: NdofParameters | None = None) -> Array:
    """Attitudes body -> east-north-up, (x, y, z, w), as the registers hold them, shape (n, 4).

    Args:
        stamp: s, shape (n,).
        rate: rad/s, shape (n, 3).
        force: m/s^2, shape (n, 3).
        field: T, shape (n, 3).
        parameters: of the stand-in.
    """
    p = parameters or NdofParameters()
    attitude, bias = _at_rest(force[0], field[0]), np.zeros(3)
    out = np.empty((len(stamp), 4))
    steps = np.diff(stamp, prepend=stamp[0])
    for i, dt in enumerate(steps):
        attitude = attitude * Rotation.from_rotvec((rate[i] - bias) * dt)
        age = stamp[i] - stamp[0]
        grown = min(1.0, max(age / p.settle_s, 0.05))
        up = attitude.apply(force[i])
        north = attitude.apply(field[i])
        tilt = np.array([up[1], -up[0], 0.0]) / 9.81
        if abs(float(np.linalg.norm(up)) - 9.81) > p.gate:
            tilt[:] = 0.0
        turn = tilt * dt / (p.tilt_tau_s * grown)
        turn[2] = np.arctan2(north[0], north[1]) * dt / (p.heading_tau_s * grown)
        bias -= attitude.inv().apply(tilt) * dt / (p.tilt_tau_s * p.bias_tau_s)
        attitude = Rotation.from_rotvec(turn) * attitude
        out[i] = attitude.as_quat()
    return np.rint(out / LSB) * LSB


def _at_rest(force: Array, field: Array) -> Rotation:
    east = np.cross(field, force)
    north = np.cross(force, east)
    rows = np.stack([east, north, force])
    return Rotation.from_matrix(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def reported_force(attitude: Array, force: Array) -> Array:
    """Linear acceleration (steps of 0.01) plus gravity in the body, as the driver puts them together, shape (n, 3)."""
    gravity = Rotation.from_quat(attitude).inv().apply([0.0, 0.0, 9.81])
    return np.asarray(np.rint((force - gravity) * 100.0) / 100.0 + gravity)
