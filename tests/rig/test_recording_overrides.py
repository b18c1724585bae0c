"""The QoS file for `ros2 bag record`: shipped as made, every topic deep enough, in the form that rosbag2 reads."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from gsense_rig import record
from gsense_rig.recording.typestore import typestore

SHIPPED = Path(__file__).resolve().parents[2] / "src" / "gsense_rig" / "config" / "record_qos.yaml"


def test_the_shipped_file_is_what_the_command_prints(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["record", "--qos-overrides"])
    assert record.main() == 0
    assert capsys.readouterr().out == SHIPPED.read_text()


def test_every_topic_of_the_contract_is_deep_and_reliable() -> None:
    data = yaml.safe_load(SHIPPED.read_text())
    constants = {name: str(value) for name, _, value in typestore().fielddefs["gsense_msgs/msg/Topics"][0]}
    plain = (
        "BATTERY",
        "LINK",
        "RIG_POSE",
        "RIG_JOINT_STATES",
        "RIG_STATE",
        "MPU6050_IMU_RAW",
        "BNO055_IMU",
        "BNO055_IMU_MAG",
    )
    expected = {f"/{constants[name]}" for name in plain}
    expected |= {"/diagnostics", "/mpu6050/residual", "/lisy300/vqf/imu/data", "/bno055/rig_aided_gcomp/imu/data"}
    assert expected <= set(data)
    assert all(
        entry == {"history": "keep_last", "depth": 2000, "reliability": "reliable", "durability": "volatile"}
        for entry in data.values()
    )


def test_a_namespace_comes_before_relative_names(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.argv", ["record", "--qos-overrides", "rail_2"])
    assert record.main() == 0
    names = set(yaml.safe_load(capsys.readouterr().out))
    assert {"/rail_2/rig/pose", "/rail_2/link", "/diagnostics"} <= names
