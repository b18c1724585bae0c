"""G, k and bias: truth within the errors, not significant where there is none, measured recordings as known."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from tests.fusion.bag_data import recordings
from tests.study.poses import PoseParameters, PoseSession, simulate_poses

from gsense_fusion.bags import load_run
from gsense_fusion.calibrate import main
from gsense_fusion.calibration.gyro import GyroCalibration, calibrate_gyro
from gsense_fusion.compensation import GSensitivity, load_compensation
from gsense_fusion.identification.motion.earth import Site
from gsense_fusion.identification.types import Role


def _calibrated(session: PoseSession, variant: str = "matrix") -> GyroCalibration:
    return calibrate_gyro([(session.run, Role.FIT)], "mpu6050", variant, Site(50.0))[0]


def test_poses_give_g_and_bias() -> None:
    session = simulate_poses(PoseParameters(seed=3, poses=16))
    found = _calibrated(session)
    assert found.significant
    assert np.abs((found.g_sensitivity.value - session.g) / found.g_sensitivity.stderr).max() < 4
    assert (
        np.abs(
            (found.bias.value - session.bias - session.drift.mean(axis=0) + session.g @ session.accel_bias)
            / found.bias.stderr
        ).max()
        < 4
    )
    np.testing.assert_allclose(found.g_sensitivity.value, session.g, atol=3e-5)
    before, after = found.held_out["before"].pose, found.held_out["after"].pose
    assert before is not None
    assert after is not None
    assert after < 0.2 * before
    assert found.permutation_p_value == pytest.approx(0.001)
    matrix = next(t for t in found.file.terms if isinstance(t, GSensitivity)).full_matrix
    np.testing.assert_allclose(matrix, found.g_sensitivity.value)


def test_k_of_a_cyclic_sensor() -> None:
    session = simulate_poses(PoseParameters(seed=5, poses=16, cyclic=True))
    found = _calibrated(session, "k")
    assert (found.k.value - session.g[0, 1]) / found.k.stderr == pytest.approx(0, abs=4)
    assert found.file.terms[0] == GSensitivity(k=float(found.k.value))
    # one number does what nine do
    k, matrix = found.held_out["k"].pose, found.held_out["matrix"].pose
    assert k is not None
    assert matrix is not None
    assert k < 1.2 * matrix


@pytest.mark.parametrize("seed", [11, pytest.param(12, marks=pytest.mark.slow)])
def test_nothing_there_is_not_significant(seed: int) -> None:
    found = _calibrated(simulate_poses(PoseParameters(seed=seed, poses=14, g_typical=0.0)))
    assert not found.significant
    assert found.file.terms == ()
    assert found.held_out["after"] == found.held_out["before"]


@pytest.mark.slow
@pytest.mark.data
@pytest.mark.parametrize(
    ("sensor", "path", "real"),
    [
        ("xsens", "xsens_mti_multipose/poses_01_21", True),
        ("/imu", "rosbag2_multipose/rosbag2_2023_08_19-15_31_05", True),
        ("mpu9150", "mpu9150_units/unit_0", False),
        ("mpu9150", "mpu9150_units/unit_1", False),
        ("mpu9150", "mpu9150_array/session_3_chip_1", False),
        ("mpu9150", "mpu9150_array/session_3_chip_5", False),
    ],
)
def test_measured_recordings(sensor: str, path: str, real: bool) -> None:
    run = load_run(recordings(*path.split("/")), sensor)
    found = calibrate_gyro([(run, Role.FIT)], sensor)[0]
    assert found.significant == real
    before, after = found.held_out["before"].pose, found.held_out["after"].pose
    assert before is not None
    assert after is not None
    if not real:
        assert after == before
        return
    assert after < 0.8 * before
    if sensor == "xsens":
        assert np.degrees(before) == pytest.approx(0.07, abs=0.01)
        assert np.degrees(after) <= 0.022


@pytest.mark.data
def test_the_command_writes_what_the_interface_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = recordings("xsens_mti_multipose", "poses_01_21")
    out = tmp_path / "new" / "folder"
    code = main(["--fit", str(bag), "--sensor", "xsens", "--out", str(out), "--export", "kalibr", "openvins"])
    assert code == 0, capsys.readouterr().err
    document = json.loads((out / "calibration.json").read_text())
    assert document["schema"] == "gsense-calibration/1"
    assert document["sensor"] == "xsens"
    assert document["significant"] is True
    assert np.array(document["g_sensitivity"]["value"]).shape == np.array(document["g_sensitivity"]["stderr"]).shape
    assert document["g_sensitivity"]["unit"] == document["k"]["unit"] == "(rad/s)/(m/s^2)"
    assert len(document["bias"]["value"]) == len(document["bias"]["stderr"]) == 3
    assert isinstance(document["k"]["value"], float)
    assert document["pose_rms"]["after"] < 0.3 * document["pose_rms"]["before"]
    file = load_compensation(out / "compensation.yaml")
    assert file.sensor == "xsens"
    np.testing.assert_allclose(file.terms[0].full_matrix, document["g_sensitivity"]["value"])  # type: ignore[union-attr]
    assert file.accelerometer is not None
    np.testing.assert_allclose(
        yaml.safe_load((out / "openvins.yaml").read_text())["imu0"]["Tg"], file.terms[0].full_matrix, atol=1e-5
    )  # type: ignore[union-attr]
    assert "pose means not fitted: 0.0" in capsys.readouterr().out


@pytest.mark.data
def test_hand_held_poses_are_refused_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = recordings("mpu6050_handheld", "example_data_calibration")
    assert main(["--fit", str(bag), "--out", str(tmp_path / "out")]) == 2
    text = capsys.readouterr().err
    assert text.count("\n") == 1
    assert "still poses" in text
    assert not (tmp_path / "out").exists()


def test_a_bag_cannot_be_fitted_and_held_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--fit", "a", "--held-out", "a", "--out", str(tmp_path)]) == 2
    assert "a run that is fitted cannot judge" in capsys.readouterr().err
