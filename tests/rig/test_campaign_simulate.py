"""Simulated campaigns, read back as any user of a bag would: topics, rates, stamps, motion, effects, index."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader

from gsense_rig import simulate
from gsense_rig.campaign.index import checksum
from gsense_rig.recording.typestore import typestore

PLAN = """
runs:
  - {shape: static, duration: 6, position: 0.1, role: fit}
  - {shape: sine, amplitude: 0.15, angular_frequency: 7, duration: 8, role: fit}
  - {shape: sine, amplitude: 0.15, angular_frequency: 5, duration: 5, mounting: 180, role: held_out}
  - {shape: triangle, amplitude: 0.15, angular_frequency: 4, duration: 3, role: fit}
"""
RATES = {
    "/mpu6050/imu/data_raw": 200,
    "/bno055/imu/data_raw": 100,
    "/lisy300/imu/data_raw": 200,
    "/mpu6050/temperature": 10,
    "/bno055/temperature": 10,
    "/battery": 1,
    "/link": 1,
    "/rig/pose": 200,
    "/rig/joint_states": 200,
    "/rig/state": 50,
}


def run_command(folder: Path, out: str, *arguments: str) -> int:
    plan = folder / "plan.yaml"
    plan.write_text(PLAN)
    return simulate.main([str(plan), "--out", str(folder / out), *arguments])


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("campaign")
    assert run_command(folder, "out", "--seed", "3", "--effect", "rail_curvature=0.02") == 0
    return folder / "out"


def read(bag: Path) -> dict[str, list[tuple[int, Any]]]:
    messages: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([bag], default_typestore=typestore()) as reader:
        for connection, time, raw in reader.messages():
            messages.setdefault(connection.topic, []).append((time, reader.deserialize(raw, connection.msgtype)))
    return messages


@pytest.fixture(scope="module")
def fast(campaign: Path) -> dict[str, list[tuple[int, Any]]]:
    return read(campaign / "run_01")


def stamps(messages: list[tuple[int, Any]]) -> np.ndarray:
    return np.array([m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for _, m in messages])


def imu(messages: list[tuple[int, Any]]) -> tuple[np.ndarray, np.ndarray]:
    rate = [[m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z] for _, m in messages]
    force = [[m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z] for _, m in messages]
    return np.array(rate), np.array(force)


def harmonic(t: np.ndarray, x: np.ndarray, w: float) -> np.ndarray:
    """Complex amplitude of each column at w."""
    design = np.column_stack([np.cos(w * t), np.sin(w * t), np.ones_like(t)])
    c, s, _ = np.linalg.lstsq(design, x, rcond=None)[0]
    return np.asarray(c - 1j * s)


def steady(t: np.ndarray) -> np.ndarray:
    return (t > t[0] + 4.0) & (t < t[-1] - 3.0)


def test_topics_types_and_rates(fast: dict[str, list[tuple[int, Any]]]) -> None:
    assert set(fast) == {*RATES, "/bno055/imu/mag"}
    for topic, rate in RATES.items():
        t = stamps(fast[topic])
        assert (len(t) - 1) / (t[-1] - t[0]) == pytest.approx(rate, rel=1e-3), topic
    t = stamps(fast["/bno055/imu/mag"])
    assert 9 < (len(t) - 1) / (t[-1] - t[0]) < 20.5
    assert fast["/mpu6050/imu/data_raw"][0][1].__msgtype__ == "sensor_msgs/msg/Imu"
    assert fast["/rig/state"][0][1].__msgtype__ == "gsense_msgs/msg/RigState"


def test_stamps_are_continuous_and_bag_times_follow(fast: dict[str, list[tuple[int, Any]]]) -> None:
    for topic in ("/mpu6050/imu/data_raw", "/rig/pose"):
        t = stamps(fast[topic])
        assert np.diff(t) == pytest.approx(np.full(len(t) - 1, 0.005), abs=1e-4), topic
        arrival = np.array([time for time, _ in fast[topic]]) * 1e-9
        assert (arrival - t).min() > 0
        assert np.median(arrival - t) < 0.005
    assert np.abs(np.diff(stamps(fast["/bno055/imu/data_raw"])) - 0.01).max() < 0.012


def test_the_motion_is_the_plans(fast: dict[str, list[tuple[int, Any]]]) -> None:
    t = stamps(fast["/rig/pose"])
    s = np.array([m.pose.position.x for _, m in fast["/rig/pose"]])
    inside = steady(t)
    assert abs(harmonic(t[inside] - t[0], s[inside], 7.0)) == pytest.approx(0.15, abs=1e-3)
    assert np.ptp(s[t < t[0] + 1.9]) < 2e-4  # still before
    assert np.ptp(s[t > t[-1] - 0.9]) < 2e-4  # and after
    joint = fast["/rig/joint_states"][1000][1]
    assert (joint.name, len(joint.position), len(joint.velocity)) == (["carriage"], 1, 1)
    assert {m.mode for _, m in fast["/rig/state"]} == {2, 3}


def test_the_accelerometer_feels_the_carriage(fast: dict[str, list[tuple[int, Any]]]) -> None:
    t = stamps(fast["/mpu6050/imu/data_raw"])
    rate, force = imu(fast["/mpu6050/imu/data_raw"])
    pose_t = stamps(fast["/rig/pose"])
    s = np.array([m.pose.position.x for _, m in fast["/rig/pose"]])
    origin = t[0]
    inside, pose_inside = steady(t), steady(pose_t)
    motion = harmonic(pose_t[pose_inside] - origin, s[pose_inside], 7.0)
    felt = harmonic(t[inside] - origin, force[inside], 7.0)[0]
    expected = -49.0 * motion * (1 - 0.02 * 0.0)
    assert abs(felt / expected) == pytest.approx(1.0, abs=0.05)  # gravity turned by the bow adds 2 %
    delay = -np.angle(felt / expected) / 7.0
    assert 0.004 < delay < 0.011  # 4.9 ms of the filter, up to 5 ms of waiting for the read
    turn = harmonic(t[inside] - origin, rate[inside], 7.0)
    # A bow of 0.02 rad/m shows as 0.02 v; this unit's g-sensitivity is a tenth of that.
    assert np.abs(turn) == pytest.approx(np.full(3, 0.02 * 0.15 * 7.0), rel=0.2)


def test_a_turned_board_sees_the_rig_turned(campaign: Path) -> None:
    t = stamps(messages := read(campaign / "run_02")["/mpu6050/imu/data_raw"])
    rate, _ = imu(messages)
    pose = read(campaign / "run_02")["/rig/pose"]
    pose_t, s = stamps(pose), np.array([m.pose.position.x for _, m in pose])
    v = harmonic(pose_t[steady(pose_t)] - t[0], s[steady(pose_t)], 5.0) * 5.0j
    ratio = (harmonic(t[steady(t)] - t[0], rate[steady(t)], 5.0) / v).real
    assert ratio == pytest.approx([-0.02, -0.02, 0.02], rel=0.25)


def test_the_encoders_scale_is_in_the_positions_alone(tmp_path: Path) -> None:
    plan = tmp_path / "plan.yaml"
    plan.write_text("runs: [{shape: static, duration: 2, position: 0.1, role: fit}]")
    for name, scale in (("true", 0.0), ("large", 0.02)):
        assert simulate.main([str(plan), "--out", str(tmp_path / name), "--effect", f"encoder_scale={scale}"]) == 0
    true, large = (read(tmp_path / name / "run_00") for name in ("true", "large"))
    for a, b in zip(true["/rig/pose"], large["/rig/pose"], strict=True):
        assert b[1].pose.position.x == pytest.approx(1.02 * a[1].pose.position.x)
    assert np.array_equal(imu(true["/mpu6050/imu/data_raw"])[1], imu(large["/mpu6050/imu/data_raw"])[1])


def test_conventions_of_the_messages(fast: dict[str, list[tuple[int, Any]]]) -> None:
    lisy = fast["/lisy300/imu/data_raw"][5][1]
    assert (lisy.angular_velocity.x, lisy.angular_velocity.y) == (0.0, 0.0)
    assert lisy.angular_velocity_covariance[[0, 4]].tolist() == [1e6, 1e6]
    assert lisy.linear_acceleration_covariance[0] == lisy.orientation_covariance[0] == -1.0
    mpu = fast["/mpu6050/imu/data_raw"][5][1]
    assert mpu.orientation_covariance[0] == -1.0
    assert mpu.linear_acceleration.z == pytest.approx(9.81, abs=0.6)
    field = fast["/bno055/imu/mag"][3][1].magnetic_field
    assert 20e-6 < np.linalg.norm([field.x, field.y, field.z]) < 80e-6
    assert fast["/link"][3][1].unit_id == "simulated-3"
    assert fast["/link"][3][1].lost == 0
    assert 3.5 < fast["/battery"][3][1].voltage < 4.3


def test_temperature_and_time_go_on_between_runs(campaign: Path) -> None:
    runs = [read(campaign / f"run_{i:02d}") for i in range(4)]
    t = [stamps(run["/mpu6050/imu/data_raw"]) for run in runs]
    assert all(later[0] - earlier[-1] > 5.0 for earlier, later in pairwise(t))
    warm = [np.mean([m.temperature for _, m in run["/mpu6050/temperature"]]) for run in runs]
    assert np.all(np.diff(warm) > 0)
    assert runs[0]["/rig/pose"][50][1].pose.position.x == pytest.approx(0.1, abs=2e-3)


def test_index_tells_everything_but_the_truth(campaign: Path) -> None:
    text = (campaign / "index.yaml").read_text()
    index = yaml.safe_load(text)
    assert [run["bag"] for run in index["runs"]] == ["run_00", "run_01", "run_02", "run_03"]
    assert [run["role"] for run in index["runs"]] == ["fit", "fit", "held_out", "fit"]
    assert {run["state"] for run in index["runs"]} == {"done"}
    for run in index["runs"]:
        assert run["checksum"] == checksum(campaign / run["bag"] / f"{run['bag']}_0.mcap")
    assert index["runs"][2]["plan"]["mounting"] == "180"
    assert "curvature" not in text
    assert "seed" not in text
    truth = yaml.safe_load((campaign / "truth.yaml").read_text())
    assert (truth["seed"], truth["effects"]) == (3, {"rail_curvature": 0.02})


def test_what_is_missing_is_made_again_bit_for_bit(campaign: Path) -> None:
    """A run that was lost (or cut off) comes back the same; the others are not touched."""
    lost = campaign / "run_01" / "run_01_0.mcap"
    kept = campaign / "run_03" / "run_03_0.mcap"
    before, untouched = checksum(lost), kept.stat().st_mtime_ns
    lost.write_bytes(lost.read_bytes()[:1000])
    assert run_command(campaign.parent, "out", "--seed", "3", "--effect", "rail_curvature=0.02") == 0
    assert checksum(lost) == before
    assert kept.stat().st_mtime_ns == untouched
    assert not (campaign / ".unfinished").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--seed", "4", "--effect", "rail_curvature=0.02"), "another plan, seed or effect"),
        (("--seed", "3"), "another plan, seed or effect"),
        (("--effect", "nonsense=1"), "is unknown; known names"),
    ],
)
def test_refuses_in_one_line(
    campaign: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], words: str
) -> None:
    assert run_command(campaign.parent, "out", *arguments) == 2
    err = capsys.readouterr().err
    assert words in err
    assert err.count("\n") == 1


def test_refuses_a_folder_with_something_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").write_text("mine")
    assert run_command(tmp_path, "out") == 2
    assert "not empty" in capsys.readouterr().err
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["thesis.txt"]


def test_frames_are_lost_on_the_way(tmp_path: Path) -> None:
    assert run_command(tmp_path, "out", "--effect", "sample_loss=0.1") == 0
    messages = read(tmp_path / "out" / "run_01")
    at = stamps(messages["/mpu6050/imu/data_raw"])
    whole = (at[-1] - at[0]) * 200 + 1
    assert 1.0 - at.shape[0] / whole == pytest.approx(0.1, abs=0.03)
    assert np.diff(at).max() > 0.014  # some in a row
    assert messages["/link"][-1][1].lost > 50
    pose = stamps(messages["/rig/pose"])
    assert np.diff(pose).max() < 0.006


def test_stamps_of_a_clock_that_runs_too_fast(tmp_path: Path) -> None:
    assert run_command(tmp_path, "out", "--effect", "clock_skew=0.01") == 0
    for run in ("run_01", "run_02"):
        messages = read(tmp_path / "out" / run)
        at, pose = stamps(messages["/mpu6050/imu/data_raw"]), stamps(messages["/rig/pose"])
        arrived = np.array([time for time, _ in messages["/mpu6050/imu/data_raw"]]) * 1e-9
        assert np.polyfit(arrived - arrived[0], at - at[0], 1)[0] == pytest.approx(1.01, abs=5e-4)
        assert abs(arrived[0] - pose[0]) < 0.05
