"""Madgwick's filter, slow and clear: matrices and the report's equations one by one. Oracle of the compiled filter."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

Array = np.ndarray[Any, np.dtype[np.float64]]


def matrix(q: Array) -> Array:
    """Body -> earth as the polynomial of equation 20's objective; orthogonal only for a unit quaternion."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def objective(q: Array, earth: Array, body: Array) -> Array:
    """Equation 21: a direction of the earth as the attitude predicts it in the body, minus as measured."""
    return matrix(q).T @ earth - body


def jacobian(q: Array, earth: Array) -> Array:
    """Equation 22, d objective / d q, shape (3, 4)."""
    w, x, y, z = 2 * q
    dx, dy, dz = earth
    return np.array(
        [
            [dy * z - dz * y, dy * y + dz * z, -2 * dx * y + dy * x - dz * w, -2 * dx * z + dy * w + dz * x],
            [-dx * z + dz * x, dx * y - 2 * dy * x + dz * w, dx * x + dz * z, -dx * w - 2 * dy * z + dz * y],
            [dx * y - dy * x, dx * z - dy * w - 2 * dz * x, dx * w + dy * z - 2 * dz * y, dx * x + dy * y],
        ]
    )


def step(
    q: Array,
    dt: float,
    rate: Array,
    force: Array,
    field: Array | None,
    beta: tuple[float, float],
    *,
    projected: bool = False,
) -> Array:
    """One sample; `beta` is (IMU, MARG) in rad/s; `projected` is not of the report: only what turns is normalised."""
    w, x, y, z = q
    turned = Rotation.from_quat([x, y, z, w]) * Rotation.from_rotvec(rate * dt)
    x, y, z, w = turned.as_quat()
    predicted = np.array([w, x, y, z])
    if predicted @ q < 0:
        predicted = -predicted
    norm = np.linalg.norm(force)
    if not np.isfinite(norm) or norm == 0:
        return predicted
    up = np.array([0.0, 0.0, 1.0])
    gradient = jacobian(q, up).T @ objective(q, up, force / norm)  # equations 25, 26
    gain = beta[0]
    if field is not None and np.isfinite(field).all():
        m = field / np.linalg.norm(field)
        h = matrix(q) @ m  # equation 45
        b = np.array([0.0, np.hypot(h[0], h[1]), h[2]])  # equation 46, north is y
        gradient = gradient + jacobian(q, b).T @ objective(q, b, m)  # equations 29 to 32
        gain = beta[1]
    if projected:
        gradient = gradient - q * (q @ gradient)
    slope = np.linalg.norm(gradient)
    corrected = predicted - gain * dt * gradient / slope if slope > 0 else predicted  # equations 42 to 44
    return corrected / np.linalg.norm(corrected)
