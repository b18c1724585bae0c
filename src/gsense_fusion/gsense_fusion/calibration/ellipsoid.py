"""Triad on a sphere: offset and shape that put vectors of constant length on it, with errors and what is not covered.

Gravity in still poses (accelerometer) and the earth's field while the board is turned (magnetometer) are such vectors.
The model is `length = |shape (v - offset)|`; the algebraic fit gives the start, Gauss-Newton on the length the maximum
likelihood.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import norm, t

FloatArray = NDArray[np.float64]
PROBES = 200


class Shape(Enum):
    """How free the shape is."""

    SCALES = "scales"
    """A diagonal: 3 numbers."""
    TRIANGULAR = "triangular"
    """Lower triangular: scales and misalignment, the first axis keeps its direction: 6 numbers (accelerometer)."""
    SYMMETRIC = "symmetric"
    """Symmetric: no turn of its own: 6 numbers (magnetometer, soft iron)."""


@dataclass(frozen=True)
class EllipsoidFit:
    """Offset and shape with standard errors of the same shapes."""

    offset: FloatArray
    offset_stderr: FloatArray
    shape: FloatArray
    """Shape (3, 3): corrected = shape (v - offset)."""
    shape_stderr: FloatArray
    residual_rms: float
    """Of the length, in its unit."""
    direction_stderr: float
    """Largest standard error of a corrected direction over the whole sphere, rad: what is not covered shows here."""

    def apply(self, v: FloatArray) -> FloatArray:
        """Corrected vectors, shape (n, 3)."""
        return np.asarray((v - self.offset) @ self.shape.T)


def fit_ellipsoid(v: FloatArray, length: float, kind: Shape, weight: FloatArray | None = None) -> EllipsoidFit:
    """Fit offset and shape.

    Args:
        v: measured vectors, shape (n, 3).
        length: what |corrected| is.
        kind: how free the shape is.
        weight: one over the standard deviation of each vector, relative, shape (n,).

    Raises:
        ValueError: fewer vectors than parameters and two to spare, or no ellipsoid goes through them.
    """
    unpack, start = _parametrisation(kind)
    if len(v) < len(start) + 2:
        raise ValueError(f"{len(v)} vectors cannot fix {len(start)} parameters")
    w = np.ones(len(v)) if weight is None else weight / np.mean(weight)
    centre, shape = _start(v / length)
    start = np.concatenate([centre, _pack(kind, shape)])

    def error(p: FloatArray) -> FloatArray:
        offset, matrix = unpack(p)
        return np.asarray(w * (np.linalg.norm((v / length - offset) @ matrix.T, axis=1) - 1.0))

    found = least_squares(error, start, x_scale="jac", method="lm")
    spare = len(v) - len(start)
    # 1.96 standard errors shall be a 95 % interval though the variance comes from few vectors
    variance = float(found.fun @ found.fun) / spare * float(t.ppf(0.975, spare) / norm.ppf(0.975)) ** 2
    jacobian = np.asarray(found.jac, dtype=np.float64)
    normal = jacobian.T @ jacobian
    if np.linalg.cond(normal) > 1e14:
        raise ValueError("the vectors do not fix an ellipsoid: they lie in too few directions")
    covariance = variance * np.linalg.inv(normal)
    offset, matrix = unpack(found.x)
    spread = _linear_stderr(lambda p: unpack(p)[1].ravel(), found.x, covariance).reshape(3, 3)
    return EllipsoidFit(
        offset=offset * length,
        offset_stderr=np.sqrt(np.diag(covariance)[:3]) * length,
        shape=matrix,
        shape_stderr=spread,
        residual_rms=float(np.sqrt(np.mean((found.fun / w) ** 2))) * length,
        direction_stderr=_worst_direction(unpack, found.x, covariance),
    )


def largest_hole(directions: FloatArray) -> float:
    """Largest angle from any direction of the sphere to the nearest of the given ones, rad; unit vectors (n, 3)."""
    cosine = (fibonacci_sphere(PROBES) @ directions.T).max(axis=1)
    return float(np.arccos(np.clip(cosine.min(), -1.0, 1.0)))


def fibonacci_sphere(n: int) -> FloatArray:
    """Unit vectors evenly over the sphere, shape (n, 3)."""
    i = np.arange(n) + 0.5
    z = 1 - 2 * i / n
    turn = np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def _parametrisation(kind: Shape) -> tuple[Callable[[FloatArray], tuple[FloatArray, FloatArray]], FloatArray]:
    def unpack(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        q = p[3:]
        if kind is Shape.SCALES:
            return p[:3], np.diag(q)
        if kind is Shape.TRIANGULAR:
            return p[:3], np.array([[q[0], 0, 0], [q[3], q[1], 0], [q[4], q[5], q[2]]])
        return p[:3], np.array([[q[0], q[3], q[4]], [q[3], q[1], q[5]], [q[4], q[5], q[2]]])

    return unpack, np.zeros(6 if kind is Shape.SCALES else 9)


def _pack(kind: Shape, shape: FloatArray) -> FloatArray:
    """Parameters of the nearest shape of the kind with the same ellipsoid (shape^T shape)."""
    metric = shape.T @ shape
    if kind is Shape.SCALES:
        return np.sqrt(np.diag(metric))
    if kind is Shape.TRIANGULAR:  # metric = L^T L with L lower triangular
        flipped = np.linalg.cholesky(metric[::-1, ::-1])
        lower = flipped.T[::-1, ::-1]
        return lower[[0, 1, 2, 1, 2, 2], [0, 1, 2, 0, 0, 1]]
    values, vectors = np.linalg.eigh(metric)
    root = vectors * np.sqrt(values) @ vectors.T
    return root[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def _start(v: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Algebraic fit of a quadric: centre and a shape that makes it the unit sphere; a sphere where it is none."""
    x, y, z = v.T
    D = np.stack([x * x, y * y, z * z, 2 * x * y, 2 * x * z, 2 * y * z, 2 * x, 2 * y, 2 * z], axis=1)
    a, *_ = np.linalg.lstsq(D, np.ones(len(v)), rcond=None)
    A = np.array([[a[0], a[3], a[4]], [a[3], a[1], a[5]], [a[4], a[5], a[2]]])
    if np.linalg.matrix_rank(A) == 3:
        centre = -np.linalg.solve(A, a[6:])
        metric = A / (1 + centre @ A @ centre)
        values, vectors = np.linalg.eigh(metric)
        if values.min() > 0.1:
            return centre, vectors * np.sqrt(values) @ vectors.T
    sphere = np.column_stack([2 * v, np.ones(len(v))])
    b, *_ = np.linalg.lstsq(sphere, np.sum(v**2, axis=1), rcond=None)
    radius = float(np.sqrt(max(b[3] + b[:3] @ b[:3], 1e-6)))
    return b[:3], np.eye(3) / radius


def _linear_stderr(f: Callable[[FloatArray], FloatArray], p: FloatArray, covariance: FloatArray) -> FloatArray:
    """Standard errors of a function of the parameters, by its numerical derivative."""
    step = 1e-6
    J = np.stack([(f(p + step * e) - f(p - step * e)) / (2 * step) for e in np.eye(len(p))], axis=1)
    return np.asarray(np.sqrt(np.einsum("ij,jk,ik->i", J, covariance, J)))


def _worst_direction(
    unpack: Callable[[FloatArray], tuple[FloatArray, FloatArray]], p: FloatArray, covariance: FloatArray
) -> float:
    offset, matrix = unpack(p)
    probes = fibonacci_sphere(PROBES)
    v = offset + probes @ np.linalg.inv(matrix).T

    def directions(q: FloatArray) -> FloatArray:
        o, m = unpack(q)
        u = (v - o) @ m.T
        u = u / np.linalg.norm(u, axis=1, keepdims=True)
        return np.asarray((u - probes * np.sum(u * probes, axis=1, keepdims=True)).ravel())

    spread = _linear_stderr(directions, p, covariance).reshape(-1, 3)
    return float(np.sqrt((spread**2).sum(axis=1).max()))
