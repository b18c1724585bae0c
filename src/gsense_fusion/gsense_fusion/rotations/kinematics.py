"""Direction cosines, Euler angles and quaternions, and how they change with the angular rate.

Thesis, equations 2.4, 2.5 and 4.1 to 4.12, corrected where they are wrong (docs/thesis-errata.md). Conventions:

- C is the matrix reference -> body of equation 4.1: `v_body = C v_reference`.
- Euler angles are (roll, pitch, yaw): the reference is turned by yaw about z, then by pitch about the new y, then by
  roll about the new x, into the body (scipy's "ZYX").
- Quaternions are (w, x, y, z), unit, body -> reference.
- Angular rates are of the body against the reference, in the body's axes, rad/s.
"""

from __future__ import annotations

from math import cos, degrees, pi, radians, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]
LOCK = radians(0.01)
"""rad: pitches nearer to +-90 degrees are a gimbal lock."""


class GimbalLockError(ValueError):
    """Pitch of +-90 degrees: roll and yaw turn about the same axis, and only their sum or difference is known."""


def skew(vector: ArrayLike) -> FloatArray:
    """Matrix of the cross product, equation 4.3: `skew(a) @ b = a x b`; shape (3,) -> (3, 3)."""
    x, y, z = np.asarray(vector, dtype=np.float64)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def dcm_rate(dcm: ArrayLike, angular_rate: ArrayLike) -> FloatArray:
    """Derivative of C, equation 4.1, 1/s, shape (3, 3)."""
    return np.asarray(-skew(angular_rate) @ np.asarray(dcm, dtype=np.float64))


def dcm_from_euler(roll: float, pitch: float, yaw: float) -> FloatArray:
    """C of Euler angles, shape (3, 3): equation 4.4 with the signs of pitch put right."""
    return np.asarray(Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_matrix().T)


def _unlocked(pitch: float) -> None:
    if abs(abs(pitch) - pi / 2) < LOCK:
        raise GimbalLockError(
            f"gimbal lock: pitch is {degrees(pitch):.3f} degrees, roll and yaw are not defined; use the quaternion"
        )


def euler_from_dcm(dcm: ArrayLike) -> FloatArray:
    """(roll, pitch, yaw) of C, rad, shape (3,).

    Raises:
        GimbalLockError: pitch within 0.01 degrees of +-90 degrees.
    """
    c = np.asarray(dcm, dtype=np.float64)
    pitch = float(np.arctan2(-c[0, 2], np.hypot(c[1, 2], c[2, 2])))
    _unlocked(pitch)
    return np.array([np.arctan2(c[1, 2], c[2, 2]), pitch, np.arctan2(c[0, 1], c[0, 0])])


def euler_rates(roll: float, pitch: float, angular_rate: ArrayLike) -> FloatArray:
    """Rates of (roll, pitch, yaw), equation 4.5, rad/s, shape (3,).

    Raises:
        GimbalLockError: pitch within 0.01 degrees of +-90 degrees.
    """
    _unlocked(pitch)
    x, y, z = np.asarray(angular_rate, dtype=np.float64)
    yaw_part = (sin(roll) * y + cos(roll) * z) / cos(pitch)
    return np.array([x + sin(pitch) * yaw_part, cos(roll) * y - sin(roll) * z, yaw_part])


def rate_from_euler_rates(roll: float, pitch: float, rates: ArrayLike) -> FloatArray:
    """Angular rate of the body, rad/s, shape (3,): the inverse of equation 4.5, in place of equation 4.6."""
    r, p, y = np.asarray(rates, dtype=np.float64)
    return np.array(
        [
            r - sin(pitch) * y,
            cos(roll) * p + sin(roll) * cos(pitch) * y,
            -sin(roll) * p + cos(roll) * cos(pitch) * y,
        ]
    )


def quaternion_product(a: ArrayLike, b: ArrayLike) -> FloatArray:
    """Hamilton's product, equation 4.8, shape (4,)."""
    aw, ax, ay, az = np.asarray(a, dtype=np.float64)
    bw, bx, by, bz = np.asarray(b, dtype=np.float64)
    return np.array(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def quaternion_from_axis(axis: ArrayLike, angle: float) -> FloatArray:
    """Turn by an angle (rad) about an axis, equation 4.10, shape (4,).

    Raises:
        ValueError: an axis of no length.
    """
    n = np.asarray(axis, dtype=np.float64)
    length = float(np.linalg.norm(n))
    if not length > 0:
        raise ValueError(f"an axis needs a length, not {axis!r}")
    return np.concatenate([[cos(angle / 2)], sin(angle / 2) * n / length])


def quaternion_rate(quaternion: ArrayLike, angular_rate: ArrayLike) -> FloatArray:
    """Derivative of the quaternion, equation 4.11, 1/s, shape (4,)."""
    return 0.5 * quaternion_product(quaternion, np.concatenate([[0.0], np.asarray(angular_rate, dtype=np.float64)]))


def quaternion_from_euler(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Quaternion of Euler angles, w >= 0, shape (4,)."""
    quaternion = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat(canonical=True)
    return np.asarray(quaternion[[3, 0, 1, 2]])


def euler_from_quaternion(quaternion: ArrayLike) -> FloatArray:
    """(roll, pitch, yaw), equation 4.12 with the arc tangents over all four quadrants, rad, shape (3,).

    Raises:
        GimbalLockError: pitch within 0.01 degrees of +-90 degrees.
    """
    w, x, y, z = np.asarray(quaternion, dtype=np.float64)
    return euler_from_dcm(Rotation.from_quat([x, y, z, w]).as_matrix().T)


def transform_from_vectors(source: ArrayLike, target: ArrayLike) -> FloatArray:
    """The turn that takes measured vectors of one frame to those of another, shape (3, 3), least squares.

    Equation 2.5 gives a matrix of rank one for a single pair of vectors, which is no rotation: at least two directions
    are needed (Wahba's problem).

    Args:
        source: vectors in the first frame, shape (n, 3).
        target: the same vectors in the second frame, shape (n, 3).

    Raises:
        ValueError: fewer than two different directions.
    """
    a, b = np.atleast_2d(np.asarray(source, dtype=np.float64)), np.atleast_2d(np.asarray(target, dtype=np.float64))
    if len(a) < 2 or np.linalg.matrix_rank(a, tol=1e-9 * float(np.abs(a).max())) < 2:
        raise ValueError("one direction does not fix a rotation: two different ones are needed")
    turn, _ = Rotation.align_vectors(b, a)
    return np.asarray(turn.as_matrix())
