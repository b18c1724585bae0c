"""Measured recordings (and two simulated sessions from elsewhere): what is known about them is found, no more."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tests.fusion.bag_data import recordings

from gsense_fusion.bags import load_run
from gsense_fusion.identification.engine import Settings, close_loop
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import IdentificationError, Role

pytestmark = pytest.mark.data


def _loop(sensor: str, *path: str, declared: tuple[str, ...] = ("bias", "g_sensitivity")) -> LoopResult:
    return close_loop([(load_run(recordings(*path), sensor), Role.FIT)], Settings(sensor, declared=declared))


def test_xsens_lacks_g_sensitivity() -> None:
    result = _loop("xsens", "xsens_mti_multipose", "poses_01_21", declared=("bias",))
    assert result.verdict == "effects_found", result.unexplained
    assert [f.effect for f in result.findings] == ["g_sensitivity"]
    assert result.pose_rms is not None
    raw, full = np.degrees(result.pose_rms.raw), np.degrees(result.pose_rms.full)
    assert raw == pytest.approx(0.07, abs=0.015)
    assert full < 0.025
    g = np.degrees([[result.findings[0].parameters[f"g_{r}{c}"].value for c in "xyz"] for r in "xyz"]) * 9.81
    assert g == pytest.approx(np.array([[0.01, 0.03, 0.07], [-0.16, 0, 0.10], [-0.08, -0.10, 0.03]]), abs=0.02)


@pytest.mark.parametrize("declared", [("bias",), ("bias", "g_sensitivity")])
@pytest.mark.parametrize("unit", ["unit_0", "unit_1"])
def test_mpu9150_lacks_nothing(unit: str, declared: tuple[str, ...]) -> None:
    result = _loop("mpu9150", "mpu9150_units", unit, declared=declared)
    assert result.verdict == "nothing_missing", (result.findings, result.unexplained)
    assert result.g_matrix is None


def test_hand_held_poses_are_refused() -> None:
    with pytest.raises(IdentificationError, match="still"):
        _loop("mpu6050", "mpu6050_handheld", "example_data_calibration")


@pytest.mark.parametrize(("session", "lacks"), [("session_a", False), ("session_b", True)])
def test_rail_sessions_from_elsewhere(session: str, lacks: bool) -> None:
    folder = recordings("rail_sessions", session)
    roles = json.loads((folder / "runs.json").read_text(encoding="utf-8"))
    runs = [(load_run(folder / name, "mpu6050"), Role(role)) for role in ("fit", "held_out") for name in roles[role]]
    result = close_loop(runs, Settings("mpu6050"))
    if not lacks:
        assert result.verdict == "nothing_missing", (result.findings, result.unexplained)
        return
    assert result.verdict != "nothing_missing"
    # g_squared: the second order of the drive, and no effect that is not there
    named = {f.effect for f in result.findings} - {"g_squared"}
    assert not named
