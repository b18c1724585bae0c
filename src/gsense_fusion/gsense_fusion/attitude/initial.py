"""Attitude of a sensor at rest, from the mean specific force and, where there is one, the mean magnetic field."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from .interface import FloatArray


def attitude_at_rest(specific_force: FloatArray, field: FloatArray | None = None) -> FloatArray:
    """Attitude in which a sensor at rest measures these means.

    Args:
        specific_force: mean at rest, m/s^2, shape (3,); points up.
        field: mean magnetic field, any unit, shape (3,); None: no heading is known, and the sensor's x axis (where it
            stands upright: its y axis) is taken to point east.

    Returns:
        Quaternion (w, x, y, z), body -> ENU, shape (4,), w >= 0.

    Raises:
        ValueError: no direction of up (a force that is zero or not finite), or a field parallel to it.
    """
    up = _unit(np.asarray(specific_force, dtype=np.float64), "specific force")
    if field is None:
        forward = np.array([1.0, 0.0, 0.0]) if abs(up[0]) < 0.9 else np.array([0.0, 1.0, 0.0])
        north = _unit(np.cross(up, forward), "specific force")
        east = np.cross(north, up)
    else:
        # the field points north and down (or up, in the south), so field x up is east
        east = _unit(np.cross(_unit(np.asarray(field, dtype=np.float64), "magnetic field"), up), "magnetic field")
        north = np.cross(up, east)
    turn = Rotation.from_matrix(np.stack([east, north, up]))  # rows are the earth's axes in the body's
    x, y, z, w = turn.as_quat()
    return np.array([w, x, y, z]) * (1.0 if w >= 0 else -1.0)


def _unit(vector: FloatArray, what: str) -> FloatArray:
    length = float(np.linalg.norm(vector))
    if not (np.isfinite(length) and length > 1e-9 * max(1.0, float(np.max(np.abs(vector))))):
        raise ValueError(f"no direction in the mean {what} {vector}")
    return np.asarray(vector / length, dtype=np.float64)


def levelled(quaternion: FloatArray, specific_force: FloatArray) -> FloatArray:
    """The attitude turned by the smallest turn that makes the mean specific force point up; the heading stays.

    Args:
        quaternion: body -> ENU, (w, x, y, z), shape (4,).
        specific_force: mean at rest, m/s^2, shape (3,).

    Returns:
        Quaternion, shape (4,).

    Raises:
        ValueError: no direction of up.
    """
    w, x, y, z = quaternion
    now = Rotation.from_quat([x, y, z, w])
    up = now.apply(_unit(np.asarray(specific_force, dtype=np.float64), "specific force"))
    axis = np.cross(up, [0.0, 0.0, 1.0])
    length = float(np.linalg.norm(axis))
    if length < 1e-12:
        axis, length = np.array([1.0, 0.0, 0.0]), 1.0  # upright already, or upside down: any horizontal axis
    angle = float(np.arctan2(np.hypot(up[0], up[1]), up[2]))
    x, y, z, w = (Rotation.from_rotvec(axis * (angle / length)) * now).as_quat()
    return np.array([w, x, y, z])


def headed(quaternion: FloatArray, field: FloatArray) -> FloatArray:
    """The attitude turned about the vertical until the field points north.

    Args:
        quaternion: body -> ENU, (w, x, y, z), shape (4,).
        field: magnetic field in the body, any unit, shape (3,).

    Returns:
        Quaternion, shape (4,).
    """
    w, x, y, z = quaternion
    now = Rotation.from_quat([x, y, z, w])
    east, north, _ = now.apply(field)
    x, y, z, w = (Rotation.from_rotvec([0.0, 0.0, float(np.arctan2(east, north))]) * now).as_quat()
    return np.array([w, x, y, z])
