"""Compiled steps that several filters share. `m` is a filter's memory: its first four numbers are the quaternion.

Body -> ENU, (w, x, y, z). Each function changes the quaternion in place and leaves it a unit one.
"""

from __future__ import annotations

from math import atan2, cos, isfinite, sin, sqrt

from numba import njit

SIGNATURE_IMU = "void(f8[::1], f8, f8[::1], f8[::1])"
"""memory, dt, angular rate, specific force."""
SIGNATURE_FIELD = "void(f8[::1], f8, f8[::1], f8[::1], f8[::1])"
"""memory, dt, angular rate, specific force, magnetic field (rows of NaN: none)."""
SIGNATURE_BATCH = "f8[:, ::1](f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])"
"""The same for n samples; a field of no rows: none at all."""


@njit("f8(f8[::1])", cache=True)
def length(v):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Length of a vector; NaN where it is not finite, so that comparisons with it are false."""
    norm = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return norm if isfinite(norm) else float("nan")


@njit("void(f8[::1], f8, f8, f8, f8)", cache=True)
def turn(m, dt, wx, wy, wz):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Turn by the constant rate (wx, wy, wz) in the body over dt: exact solution of the thesis's equation 4.11."""
    w, x, y, z = m[0], m[1], m[2], m[3]
    rate = sqrt(wx * wx + wy * wy + wz * wz)
    half = 0.5 * rate * dt
    if half < 0.1:  # the usual case: series, exact to the last digit, at a third of the cost
        u = half * half
        s = 0.5 * dt * (1.0 - u / 6.0 * (1.0 - u / 20.0 * (1.0 - u / 42.0 * (1.0 - u / 72.0))))
        c = 1.0 - u / 2.0 * (1.0 - u / 12.0 * (1.0 - u / 30.0 * (1.0 - u / 56.0 * (1.0 - u / 90.0))))
    else:
        s, c = sin(half) / rate, cos(half)
    sx, sy, sz = s * wx, s * wy, s * wz
    a = w * c - x * sx - y * sy - z * sz
    b = w * sx + x * c + y * sz - z * sy
    d = w * sy - x * sz + y * c + z * sx
    e = w * sz + x * sy - y * sx + z * c
    scale = 1.0 / sqrt(a * a + b * b + d * d + e * e)
    m[0], m[1], m[2], m[3] = a * scale, b * scale, d * scale, e * scale


@njit("void(f8[::1], f8, f8, f8)", cache=True)
def turn_earth(m, rx, ry, rz):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Turn by the rotation vector (rx, ry, rz), given in the earth frame."""
    w, x, y, z = m[0], m[1], m[2], m[3]
    angle = sqrt(rx * rx + ry * ry + rz * rz)
    s = 0.5 if angle < 1e-9 else sin(0.5 * angle) / angle
    c, sx, sy, sz = cos(0.5 * angle), s * rx, s * ry, s * rz
    m[0] = c * w - sx * x - sy * y - sz * z
    m[1] = c * x + sx * w + sy * z - sz * y
    m[2] = c * y - sx * z + sy * w + sz * x
    m[3] = c * z + sx * y - sy * x + sz * w


@njit("UniTuple(f8, 3)(f8[::1], f8, f8, f8)", cache=True)
def to_earth(m, vx, vy, vz):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """A vector of the body in the earth frame."""
    w, x, y, z = m[0], m[1], m[2], m[3]
    tx = 2.0 * (y * vz - z * vy)
    ty = 2.0 * (z * vx - x * vz)
    tz = 2.0 * (x * vy - y * vx)
    return (vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx)


@njit("UniTuple(f8, 3)(f8[::1], f8[::1])", cache=True)
def tilt_error(m, force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """The smallest turn, as a rotation vector in the earth frame, that makes the specific force point up."""
    ex, ey, ez = to_earth(m, force[0], force[1], force[2])
    flat = sqrt(ex * ex + ey * ey)
    angle = atan2(flat, ez)
    if flat == 0.0:
        return (angle, 0.0, 0.0)  # upright, or upside down: any horizontal axis
    return (angle * ey / flat, -angle * ex / flat, 0.0)


@njit("f8(f8[::1], f8[::1])", cache=True)
def heading_error(m, field):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Angle about the earth's vertical that turns the horizontal part of the field to the north."""
    ex, ey, _ = to_earth(m, field[0], field[1], field[2])
    return atan2(ex, ey)
