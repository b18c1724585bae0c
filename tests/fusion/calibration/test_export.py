"""Exports: the equations that Kalibr and OpenVINS publish, fed with the file, must explain a simulated signal."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from gsense_fusion.calibration.export import export
from gsense_fusion.compensation import (
    AccelerometerCorrection,
    CompensationFile,
    GSensitivity,
    ScaleMisalignment,
    TemperatureBias,
    compensate,
    corrected_force,
)

G = ((1e-3, 2e-4, -3e-4), (4e-4, -5e-4, 6e-4), (7e-4, 8e-4, 9e-4))
M = ((0.01, 0.004, -0.002), (0.003, -0.02, 0.005), (-0.006, 0.001, 0.015))
A = ((1.01, 0.0, 0.0), (0.004, 0.99, 0.0), (-0.003, 0.002, 1.005))
FILE = CompensationFile(
    "mpu6050",
    bias=(0.01, -0.02, 0.03),
    terms=(GSensitivity(matrix=G), ScaleMisalignment(M)),
    accelerometer=AccelerometerCorrection(A, (0.2, -0.1, 0.3)),
)


def _signals() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """A body that turns and swings: true rate and specific force, and what our sensor model makes of them."""
    rng = np.random.default_rng(4)
    t = np.arange(0, 5, 0.01)
    turn = Rotation.from_rotvec(np.stack([np.sin(t), np.cos(1.3 * t), 0.5 * t], axis=1))
    acceleration = np.stack([9 * np.sin(7 * t), 2 * np.cos(3 * t), np.sin(t)], axis=1)
    true_force = turn.inv().apply(acceleration - [0.0, 0.0, -9.80665])  # a - g, g points down: up at rest
    true_rate = rng.normal(size=true_force.shape)
    force = true_force @ np.linalg.inv(np.array(A)).T + [0.2, -0.1, 0.3]
    # our model read backwards: rate = (I + M)(w + b) + G f
    rate = (true_rate + FILE.bias) @ (np.eye(3) + np.array(M)).T + force @ np.array(G).T
    return true_rate, true_force, rate, force


def test_our_own_compensation_gives_the_truth() -> None:
    true_rate, true_force, rate, force = _signals()
    stamp = np.arange(len(rate)) * 10_000_000
    np.testing.assert_allclose(compensate(FILE, stamp, rate, force) - FILE.bias, true_rate, atol=1e-12)
    np.testing.assert_allclose(corrected_force(FILE, force), true_force, atol=1e-12)


def _read(name: str, file: CompensationFile = FILE) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load(export(file, name))["imu0"]
    return content


def _bias_g() -> np.ndarray:
    """The gyro bias in either program's equation, as the head of the files says it."""
    head = export(FILE, "kalibr").splitlines()[0]
    return np.array(yaml.safe_load(head[head.index("[") : head.index("]") + 1]))


def test_kalibr_predicts_what_the_sensor_measures() -> None:
    """omega_m = M C w + A C a + b_g; a_m = M_a a + b_a (IccSensors.py, scale-misalignment)."""
    true_rate, true_force, rate, force = _signals()
    y = _read("kalibr")
    Mg, Ag, C = (np.array(y["gyroscopes"][key]) for key in ("M", "A", "C_gyro_i"))
    Ma = np.array(y["accelerometers"]["M"])
    np.testing.assert_allclose(true_rate @ (Mg @ C).T + true_force @ (Ag @ C).T + _bias_g(), rate, atol=1e-7)
    np.testing.assert_allclose(true_force @ Ma.T + [0.2, -0.1, 0.3], force, atol=1e-12)
    # what Kalibr's design variables allow: lower triangles, a rotation
    for triangle in (Mg, Ma):
        np.testing.assert_allclose(np.triu(triangle, 1), 0, atol=1e-12)
    np.testing.assert_allclose(C @ C.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(C) == pytest.approx(1.0)


def test_openvins_gives_the_truth_from_the_measured() -> None:
    """a = R_ACCtoIMU D_a (a_m - b_a); w = R_GYROtoIMU D_w (omega_m - b_g - T_g a) (Propagator.cpp)."""
    true_rate, true_force, rate, force = _signals()
    y = _read("openvins")
    Dw, Da = (np.linalg.inv(np.array(y[key])) for key in ("Tw", "Ta"))
    a = (force - [0.2, -0.1, 0.3]) @ (np.array(y["R_IMUtoACC"]).T @ Da).T
    w = (rate - _bias_g() - a @ np.array(y["Tg"]).T) @ (np.array(y["R_IMUtoGYRO"]).T @ Dw).T
    np.testing.assert_allclose(a, true_force, atol=1e-10)
    np.testing.assert_allclose(w, true_rate, atol=1e-7)


def test_a_transposed_or_negated_matrix_would_be_noticed() -> None:
    """The signals above tell G from its transpose and its negative."""
    _, true_force, rate, force = _signals()
    for wrong in (np.array(G).T, -np.array(G)):
        assert np.abs(force @ wrong.T - force @ np.array(G).T).max() > 1e-3
    assert np.abs(rate).max() > 0
    assert np.abs(true_force).max() > 9


def test_without_accelerometer_and_scale_the_matrix_is_ours() -> None:
    file = CompensationFile("s", terms=(GSensitivity(k=2e-4), TemperatureBias((1e-3, 0, 0), 25.0)))
    k = [[0.0, 2e-4, 0.0], [0.0, 0.0, 2e-4], [2e-4, 0.0, 0.0]]
    assert _read("kalibr", file)["gyroscopes"]["A"] == k
    assert _read("openvins", file)["Tg"] == k
    assert "no place here for: temperature_bias" in export(file, "openvins")
    with pytest.raises(ValueError, match="no such format"):
        export(file, "ros")
