"""Noise parameters: a known noise gives them back, the curve is allantools', the bridge takes the file."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import rclpy
import yaml
from rclpy.context import Context
from rclpy.node import Node
from tests.fusion.bag_data import recordings
from tests.study.poses import PoseParameters, simulate_poses

from gsense_fusion.bags.run import Run
from gsense_fusion.calibration.allan import allan_curve, noise_parameters, pooled_density
from gsense_fusion.calibration.rest_noise import allan_picture, bridge_parameters, kalibr_imu, noise_json, rest_noise
from gsense_fusion.identification.types import IdentificationError
from gsense_fusion.noise import main


def _still(seconds: float) -> Run:
    return simulate_poses(PoseParameters(seed=4, poses=2, still_s=seconds, turn_s=1.0)).run


def test_white_noise_has_its_density() -> None:
    rng = np.random.default_rng(0)
    density, rate = 3e-4, 200.0
    found = [noise_parameters(density * np.sqrt(rate / 2) * rng.normal(size=40_000), rate) for _ in range(6)]
    assert pooled_density(found) == pytest.approx(density, rel=0.02)
    z = [(p.random_walk - density / np.sqrt(2)) / p.random_walk_stderr for p in found]
    assert np.abs(z).max() < 4
    c = found[0].curve
    assert np.abs((c.deviation - density / np.sqrt(2 * c.tau)) / c.stderr).max() < 4


def test_white_noise_and_random_walk_are_told_apart() -> None:
    rng = np.random.default_rng(1)
    rate, n = 50.0, 100_000
    walk = np.cumsum(2e-4 / np.sqrt(rate) * rng.normal(size=n))
    found = noise_parameters(1e-3 * np.sqrt(rate / 2) * rng.normal(size=n) + walk, rate)
    assert found.density == pytest.approx(1e-3, rel=0.05)
    assert found.rate_random_walk == pytest.approx(2e-4, rel=0.35)
    long = allan_curve(walk, rate)
    assert long.deviation[-1] > 10 * long.deviation[0]


def test_a_bag_at_rest_gives_the_bridge_its_file(tmp_path: Path) -> None:
    run = _still(60.0)
    noise = rest_noise([run], "mpu6050")
    assert noise.seconds == pytest.approx(60, abs=3)
    assert pooled_density(list(noise.gyro.values())) == pytest.approx(np.radians(0.005), rel=0.1)
    assert pooled_density(list(noise.accelerometer.values())) == pytest.approx(4e-3, rel=0.1)
    assert json.loads(noise_json(noise))["gyro"]["axes"]["z"]["density"] > 0
    assert allan_picture(noise).startswith(b"\x89PNG")
    path = tmp_path / "bridge_noise.yaml"
    path.write_text(bridge_parameters(noise), encoding="utf-8")
    context = Context()
    rclpy.init(args=["--ros-args", "--params-file", str(path)], context=context)
    try:
        node = Node("bridge", namespace="rig_2", context=context, automatically_declare_parameters_from_overrides=True)
        value = node.get_parameter("mpu6050.gyro_noise_density").value
        assert value == pytest.approx(np.radians(0.005), rel=0.1)
        assert node.get_parameter("mpu6050.accel_noise_density").value == pytest.approx(4e-3, rel=0.1)
        node.destroy_node()
    finally:
        rclpy.try_shutdown(context=context)


def test_kalibr_gets_the_deviation_at_one_second() -> None:
    """Kalibr's continuous density is that of equation sigma_discrete = density * sqrt(rate): the spread of a sample."""
    run = _still(60.0)
    noise = rest_noise([run], "/vectornav/imu")
    given = yaml.safe_load(kalibr_imu(noise))
    assert given["rostopic"] == "/vectornav/imu"
    assert given["update_rate"] == pytest.approx(run.imu.rate_hz, rel=0.01)
    still = slice(200, 5_000)
    for name, series in (("gyroscope", run.imu.angular_rate), ("accelerometer", run.imu.specific_force)):
        spread = float(np.std(np.diff(series[still], axis=0)) / np.sqrt(2))  # without drift
        assert given[f"{name}_noise_density"] * np.sqrt(given["update_rate"]) == pytest.approx(spread, rel=0.1)
        assert given[f"{name}_random_walk"] > 0


def test_too_little_rest_is_said() -> None:
    with pytest.raises(IdentificationError, match="30 s are needed"):
        rest_noise([_still(10.0)], "mpu6050")
    run = _still(10.0)
    rng = np.random.default_rng(0)
    restless = replace(run.imu, angular_rate=run.imu.angular_rate + rng.normal(size=run.imu.angular_rate.shape))
    with pytest.raises(IdentificationError, match="still"):
        rest_noise([replace(run, imu=restless)], "mpu6050")


@pytest.mark.data
def test_the_command_on_a_measured_rest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = recordings("mpu6050_handheld", "imu_static_test")
    assert main([str(bag), "--out", str(tmp_path / "out")]) == 0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "allan.png",
        "bridge_noise.yaml",
        "kalibr_imu.yaml",
        "noise.json",
    ]
    assert "gyro: white 0.01" in capsys.readouterr().out
    assert main([str(tmp_path / "none"), "--out", str(tmp_path / "out2")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
