"""Offset and shape of a triad: truth within its errors, refusals where the sphere is not covered."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.calibration.accelerometer import AccelerometerCalibration, calibrate_accelerometer
from gsense_fusion.calibration.ellipsoid import Shape, fibonacci_sphere, fit_ellipsoid, largest_hole
from gsense_fusion.calibration.magnetometer import MagnetometerCalibration, calibrate_magnetometer

G = 9.80665


def _directions(n: int, rng: np.random.Generator) -> np.ndarray:
    u = rng.normal(size=(n, 3))
    return u / np.linalg.norm(u, axis=1, keepdims=True)


@pytest.mark.parametrize("kind", list(Shape))
def test_exact_vectors_give_the_exact_ellipsoid(kind: Shape) -> None:
    shape = {
        Shape.SCALES: np.diag([1.1, 0.9, 1.02]),
        Shape.TRIANGULAR: np.array([[1.1, 0, 0], [0.02, 0.9, 0], [-0.03, 0.04, 1.02]]),
        Shape.SYMMETRIC: np.array([[1.1, 0.02, 0.03], [0.02, 0.9, -0.04], [0.03, -0.04, 1.02]]),
    }[kind]
    offset = np.array([0.5, -0.2, 1.0])
    v = (G * fibonacci_sphere(30)) @ np.linalg.inv(shape).T + offset
    fit = fit_ellipsoid(v, G, kind)
    np.testing.assert_allclose(fit.shape, shape, atol=1e-9)
    np.testing.assert_allclose(fit.offset, offset, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(fit.apply(v), axis=1), G)


@pytest.mark.slow
def test_intervals_cover_95_percent() -> None:
    rng = np.random.default_rng(5)
    z = []
    for _ in range(200):
        shape = np.eye(3) + np.tril(rng.normal(size=(3, 3)) * 0.01)
        bias = rng.normal(size=3) * 0.1
        f = (G * _directions(20, rng)) @ np.linalg.inv(shape).T + bias + rng.normal(size=(20, 3)) * 3e-3
        fit = fit_ellipsoid(f, G, Shape.TRIANGULAR)
        lower = np.tril_indices(3)
        z += [*((fit.offset - bias) / fit.offset_stderr), *((fit.shape - shape)[lower] / fit.shape_stderr[lower])]
    assert 0.92 < np.mean(np.abs(z) < 1.96) < 0.975


def test_accelerometer_of_all_sides() -> None:
    rng = np.random.default_rng(1)
    shape, bias = np.array([[1.01, 0, 0], [0.004, 0.99, 0], [0, -0.003, 1.005]]), np.array([0.1, -0.2, 0.3])
    f = (G * fibonacci_sphere(14)) @ np.linalg.inv(shape).T + bias + rng.normal(size=(14, 3)) * 1e-3
    found = calibrate_accelerometer(f)
    assert isinstance(found, AccelerometerCalibration)
    np.testing.assert_allclose(found.fit.shape, shape, atol=5e-4)
    np.testing.assert_allclose(found.correction.bias, bias, atol=4e-3)


@pytest.mark.parametrize(
    ("poses", "words"),
    [
        (np.repeat(G * fibonacci_sphere(5), 4, axis=0), "5 distinct still poses: 8 are needed"),
        (G * np.abs(fibonacci_sphere(60)), "put the board on all its sides"),
    ],
)
def test_accelerometer_says_what_is_lacking(poses: np.ndarray, words: str) -> None:
    found = calibrate_accelerometer(poses)
    assert isinstance(found, str)
    assert words in found


SOFT = np.array([[1.05, 0.02, -0.01], [0.02, 0.97, 0.03], [-0.01, 0.03, 0.98]])
SOFT = SOFT / np.cbrt(np.linalg.det(SOFT))
HARD = np.array([2e-5, -3e-5, 1e-5])


def _field(u: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    return (4.8e-5 * u) @ np.linalg.inv(SOFT).T + HARD + rng.normal(size=u.shape) * 3e-7


def test_magnetometer_and_a_passing_piece_of_iron() -> None:
    rng = np.random.default_rng(2)
    field = _field(_directions(600, rng), rng)
    field[100:104] += 2e-5
    found = calibrate_magnetometer(field)
    assert isinstance(found, MagnetometerCalibration)
    assert np.abs((found.fit.offset - HARD) / found.fit.offset_stderr).max() < 4
    np.testing.assert_allclose(found.fit.offset, HARD, atol=2e-7)
    np.testing.assert_allclose(found.fit.shape, SOFT, atol=6e-3)
    assert found.spread_after < 0.06 < found.spread_before
    assert found.field == pytest.approx(4.8e-5, rel=0.01)


@pytest.mark.parametrize("case", ["flat", "cap", "still", "few"])
def test_magnetometer_refuses_what_does_not_cover_the_sphere(case: str) -> None:
    rng = np.random.default_rng(3)
    u = _directions(2000, rng)
    if case == "flat":  # a board turned on a table
        u[:, 2] = 0.02 * u[:, 2]
        u /= np.linalg.norm(u, axis=1, keepdims=True)
    elif case == "cap":
        u = u[u[:, 2] > 0.3]
    elif case == "still":
        u = np.repeat(u[:1], 500, axis=0)
    else:
        u = u[:20]
    found = calibrate_magnetometer(_field(u, rng))
    assert isinstance(found, str), found
    assert "\n" not in found


def test_largest_hole() -> None:
    assert np.degrees(largest_hole(np.array([[0.0, 0.0, 1.0]]))) == pytest.approx(180, abs=8)
    assert np.degrees(largest_hole(fibonacci_sphere(200))) < 1
