"""Compiled steps that several filters share.

A quaternion is a tuple (w, x, y, z), body -> ENU, a vector a tuple of three: a loop over samples keeps them in
registers, which takes a third of the time of the same steps on an array. `m` is a filter's memory: its first four
numbers are the quaternion between calls.
"""

from __future__ import annotations

from math import atan2, cos, isfinite, sin, sqrt

from gsense_fusion.compiling import kernel

VECTOR = "UniTuple(f8, 3)"
QUATERNION = "UniTuple(f8, 4)"
SIGNATURE_IMU = "void(f8[::1], f8, f8[::1], f8[::1])"
"""memory, dt, angular rate, specific force."""
SIGNATURE_FIELD = "void(f8[::1], f8, f8[::1], f8[::1], f8[::1])"
"""memory, dt, angular rate, specific force, magnetic field (rows of NaN: none)."""
SIGNATURE_BATCH = "f8[:, ::1](f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])"
"""The same for n samples; a field of no rows: none at all."""
SIGNATURE_STEP = f"{QUATERNION}(f8[::1], {QUATERNION}, f8, {VECTOR}, {VECTOR}, {VECTOR}, b1)"
"""memory, quaternion, dt, angular rate, specific force, magnetic field, whether there is one; the new quaternion."""


@kernel(f"{QUATERNION}(f8[::1])")
def load(m):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """The quaternion of a memory."""
    return (m[0], m[1], m[2], m[3])


@kernel(f"void(f8[::1], {QUATERNION})")
def store(m, q):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Back into the memory."""
    m[0], m[1], m[2], m[3] = q


@kernel(f"{VECTOR}(f8[::1])")
def vector(row):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """The first three numbers of an array."""
    return (row[0], row[1], row[2])


@kernel(f"f8({VECTOR})")
def length(v):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Length of a vector; NaN where it is not finite, so that comparisons with it are false."""
    norm = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return norm if isfinite(norm) else float("nan")


@kernel("UniTuple(f8, 2)(f8)")
def half_turn(square):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """(sin h / h, cos h) of half an angle h, from h^2: by series where h < 0.1, exact to the last digit and quick.

    Factors, not divisors: LLVM leaves a division by 6 a division, and eight of those cost more than all the rest.
    """
    if square < 0.01:
        return (
            1.0
            - square
            * (1.0 / 6.0)
            * (1.0 - square * (1.0 / 20.0) * (1.0 - square * (1.0 / 42.0) * (1.0 - square * (1.0 / 72.0)))),
            1.0
            - square
            * 0.5
            * (1.0 - square * (1.0 / 12.0) * (1.0 - square * (1.0 / 30.0) * (1.0 - square * (1.0 / 56.0)))),
        )
    h = sqrt(square)
    return (sin(h) / h, cos(h))


@kernel("f8(f8)")
def unit_scale(square):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """1 / sqrt(square); for what is 1 but for rounding its first terms are exact to the last digit."""
    off = square - 1.0
    return 1.0 - 0.5 * off if abs(off) < 1e-8 else 1.0 / sqrt(square)


@kernel(f"{QUATERNION}({QUATERNION}, f8, {VECTOR})")
def turn(q, dt, rate):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Turned by the constant rate in the body over dt: exact solution of the thesis's equation 4.11; a unit one."""
    w, x, y, z = q
    wx, wy, wz = rate
    half = 0.5 * dt
    s, c = half_turn(half * half * (wx * wx + wy * wy + wz * wz))
    s *= half
    sx, sy, sz = s * wx, s * wy, s * wz
    a = w * c - x * sx - y * sy - z * sz
    b = w * sx + x * c + y * sz - z * sy
    d = w * sy - x * sz + y * c + z * sx
    e = w * sz + x * sy - y * sx + z * c
    scale = unit_scale(a * a + b * b + d * d + e * e)
    return (a * scale, b * scale, d * scale, e * scale)


@kernel(f"{QUATERNION}({QUATERNION}, {VECTOR})")
def turn_earth(q, r):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Turned by the rotation vector r, given in the earth frame."""
    w, x, y, z = q
    rx, ry, rz = r
    s, c = half_turn(0.25 * (rx * rx + ry * ry + rz * rz))
    sx, sy, sz = 0.5 * s * rx, 0.5 * s * ry, 0.5 * s * rz
    return (
        c * w - sx * x - sy * y - sz * z,
        c * x + sx * w + sy * z - sz * y,
        c * y - sx * z + sy * w + sz * x,
        c * z + sx * y - sy * x + sz * w,
    )


@kernel(f"{VECTOR}({QUATERNION}, {VECTOR})")
def to_earth(q, v):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """A vector of the body in the earth frame."""
    w, x, y, z = q
    vx, vy, vz = v
    tx = 2.0 * (y * vz - z * vy)
    ty = 2.0 * (z * vx - x * vz)
    tz = 2.0 * (x * vy - y * vx)
    return (vx + w * tx + y * tz - z * ty, vy + w * ty + z * tx - x * tz, vz + w * tz + x * ty - y * tx)


@kernel(f"{VECTOR}({QUATERNION}, {VECTOR})")
def tilt_error(q, force):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """The smallest turn, as a rotation vector in the earth frame, that makes the specific force point up."""
    ex, ey, ez = to_earth(q, force)
    flat = sqrt(ex * ex + ey * ey)
    angle = atan2(flat, ez)
    if flat == 0.0:
        return (angle, 0.0, 0.0)  # upright, or upside down: any horizontal axis
    scale = angle / flat
    return (scale * ey, -scale * ex, 0.0)


@kernel(f"f8({QUATERNION}, {VECTOR})")
def heading_error(q, field):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """Angle about the earth's vertical that turns the horizontal part of the field to the north."""
    ex, ey, _ = to_earth(q, field)
    return atan2(ex, ey)


@kernel(f"{QUATERNION}({QUATERNION}, {QUATERNION})")
def product(a, b):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN201
    """The turn b followed by the turn a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )
