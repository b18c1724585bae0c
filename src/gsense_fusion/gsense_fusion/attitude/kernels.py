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


@njit("UniTuple(f8, 2)(f8)", cache=True)
def half_turn(square):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """(sin h / h, cos h) of half an angle h, from h^2: by series where h < 0.1, exact to the last digit and quick."""
    if square < 0.01:
        return (
            1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0 * (1.0 - square / 72.0))),
            1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0 * (1.0 - square / 56.0))),
        )
    h = sqrt(square)
    return (sin(h) / h, cos(h))


@njit("f8(f8)", cache=True)
def unit_scale(square):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """1 / sqrt(square); for what is 1 but for rounding its first terms are exact to the last digit."""
    off = square - 1.0
    return 1.0 - 0.5 * off if abs(off) < 1e-8 else 1.0 / sqrt(square)


@njit("void(f8[::1], f8, f8, f8, f8)", cache=True)
def turn(m, dt, wx, wy, wz):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Turn by the constant rate (wx, wy, wz) in the body over dt: exact solution of the thesis's equation 4.11."""
    w, x, y, z = m[0], m[1], m[2], m[3]
    half = 0.5 * dt
    s, c = half_turn(half * half * (wx * wx + wy * wy + wz * wz))
    s *= half
    sx, sy, sz = s * wx, s * wy, s * wz
    a = w * c - x * sx - y * sy - z * sz
    b = w * sx + x * c + y * sz - z * sy
    d = w * sy - x * sz + y * c + z * sx
    e = w * sz + x * sy - y * sx + z * c
    scale = unit_scale(a * a + b * b + d * d + e * e)
    m[0], m[1], m[2], m[3] = a * scale, b * scale, d * scale, e * scale


@njit("void(f8[::1], f8, f8, f8)", cache=True)
def turn_earth(m, rx, ry, rz):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Turn by the rotation vector (rx, ry, rz), given in the earth frame."""
    w, x, y, z = m[0], m[1], m[2], m[3]
    s, c = half_turn(0.25 * (rx * rx + ry * ry + rz * rz))
    sx, sy, sz = 0.5 * s * rx, 0.5 * s * ry, 0.5 * s * rz
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
