"""Scale and misalignment from turns between still poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.fusion.bag_data import recordings
from tests.study.poses import PoseParameters, PoseSession, simulate_poses

from gsense_fusion.bags import load_run
from gsense_fusion.calibrate import main
from gsense_fusion.calibration.turns import ScaleCalibration, calibrate_scale, find_turns
from gsense_fusion.compensation import AccelerometerCorrection, ScaleMisalignment, load_compensation
from gsense_fusion.identification.recording.integrity import clean_runs
from gsense_fusion.identification.types import Role


def _found(session: PoseSession, g: np.ndarray) -> ScaleCalibration | str:
    shape = tuple(tuple(float(x) for x in row) for row in session.accel_shape)
    x, y, z = (float(v) for v in session.accel_bias)
    correction = AccelerometerCorrection(shape, (x, y, z))  # type: ignore[arg-type]
    return calibrate_scale(find_turns(clean_runs([(session.run, Role.FIT)]), g, correction))


def test_turns_give_scale_and_misalignment() -> None:
    session = simulate_poses(PoseParameters(seed=1, gyro_scale=0.01, still_s=3.0, poses=16))
    found = _found(session, session.g @ session.accel_shape)
    assert isinstance(found, ScaleCalibration)
    assert found.significant
    np.testing.assert_allclose(found.matrix, session.gyro_matrix, atol=6e-4)
    assert np.abs((found.matrix - session.gyro_matrix) / found.stderr).max() < 4
    assert found.rms_after < 0.1 * found.rms_before
    # the sign of M and its transpose matter
    assert np.abs(found.matrix + session.gyro_matrix).max() > 0.01


def test_no_scale_error_is_not_significant() -> None:
    session = simulate_poses(PoseParameters(seed=2, still_s=3.0, poses=16, g_typical=0.0))
    found = _found(session, np.zeros((3, 3)))
    assert isinstance(found, ScaleCalibration)
    assert np.abs(found.matrix).max() < 1e-3
    assert not found.significant


def test_few_turns_or_lost_samples_are_said() -> None:
    session = simulate_poses(PoseParameters(seed=2, still_s=3.0, poses=8))
    found = _found(session, session.g)
    assert isinstance(found, str)
    assert "10 are needed" in found
    imu = session.run.imu
    keep = np.arange(len(imu)) % 499 != 400  # a sample lost in every turn
    lossy = replace(
        imu,
        stamp_ns=imu.stamp_ns[keep],
        received_ns=imu.received_ns[keep],
        angular_rate=imu.angular_rate[keep],
        specific_force=imu.specific_force[keep],
    )
    assert find_turns(clean_runs([(replace(session.run, imu=lossy), Role.FIT)]), session.g, None) == []


@pytest.mark.slow
@pytest.mark.data
def test_groves_on_the_measured_xsens(tmp_path, capsys) -> None:  # type: ignore[no-untyped-def]
    """G learnt at rest makes the turns better too: an independent proof that it is no drift."""
    bag = recordings("xsens_mti_multipose", "poses_01_21")
    run = clean_runs([(load_run(bag, "xsens"), Role.FIT)])
    assert main(["--fit", str(bag), "--sensor", "xsens", "--variant", "groves", "--out", str(tmp_path)]) == 0
    assert "with both 0." in capsys.readouterr().out
    file = load_compensation(tmp_path / "compensation.yaml")
    assert isinstance(file.terms[-1], ScaleMisalignment)
    plain, with_g = (
        calibrate_scale(find_turns(run, g, file.accelerometer))
        for g in (np.zeros((3, 3)), np.array(file.terms[0].full_matrix))  # type: ignore[union-attr]
    )
    assert isinstance(plain, ScaleCalibration)
    assert isinstance(with_g, ScaleCalibration)
    assert np.degrees(plain.rms_before) > 2.0
    assert with_g.rms_after < 0.4 * plain.rms_after
