"""Bags that others recorded: Jazzy's recorder, an older one, converted recordings."""

from __future__ import annotations

import numpy as np
import pytest
from rosbags.rosbag2 import Reader

from gsense_fusion.bags import BagError, load_run
from gsense_fusion.bags.mcap_messages import Sink, read_messages

from .bag_data import recordings


@pytest.mark.parametrize(
    ("name", "imu", "pose", "mag"),
    [
        ("mcap", 1940, 1939, 194),
        ("sqlite3", 2428, 2427, 243),
        ("reindexed_mcap", 1940, 1939, 194),
        ("reindexed_sqlite3", 2428, 2427, 243),
        ("killed_sqlite3", 1036, 1036, 105),
    ],
)
def test_jazzy_recorder(name: str, imu: int, pose: int, mag: int) -> None:
    run = load_run(recordings("rosbag2_jazzy", name), "mpu6050")
    assert run.pose is not None
    assert run.mag is not None
    assert (len(run.imu), len(run.pose.stamp_ns), len(run.mag.stamp_ns)) == (imu, pose, mag)
    assert run.imu.rate_hz == pytest.approx(200.0, abs=0.5)
    assert np.median(run.imu.received_ns - run.imu.stamp_ns) < 5e6


@pytest.mark.parametrize(
    "parts",
    [("rosbag2_jazzy", "mcap", "rig_mcap_0.mcap"), ("rail_sessions", "session_a", "run_01", "run_01.mcap")],
)
def test_messages_equal_those_of_the_library(parts: tuple[str, ...]) -> None:
    path = recordings(*parts)
    ours: dict[int, list[tuple[int, bytes]]] = {}
    theirs: dict[int, list[tuple[int, bytes]]] = {}
    with Reader(path) as reader:
        for connection in reader.connections:
            ours[connection.id], theirs[connection.id] = [], []
        for connection, received, data in reader.messages():
            theirs[connection.id].append((received, bytes(data)))

    def sink(channel: int) -> Sink:
        return lambda received, data: ours[channel].extend(zip(received, data, strict=True))

    read_messages(path, {channel: sink(channel) for channel in ours})
    assert ours == theirs
    assert sum(map(len, ours.values())) > 1000


def test_lossy_recording_tells_its_loss() -> None:
    run = load_run(recordings("rosbag2_jazzy", "lossy_mcap"), "mpu6050")
    assert np.max(np.diff(run.imu.stamp_ns)) > 100e6
    assert [note[: note.index(" are missing")] for note in run.notes] == [
        "/mpu6050/imu/data_raw: 53 samples",
        "/rig/pose: 54 samples",
    ]
    assert round((run.imu.stamp_ns[-1] - run.imu.stamp_ns[0]) / 5e6) + 1 - len(run.imu) == 53


@pytest.mark.parametrize("name", ["mcap", "sqlite3", "reindexed_mcap", "reindexed_sqlite3"])
def test_whole_recordings_have_nothing_to_tell(name: str) -> None:
    assert load_run(recordings("rosbag2_jazzy", name), "mpu6050").notes == ()


def test_killed_recorder_is_read_as_far_as_it_got() -> None:
    run = load_run(recordings("rosbag2_jazzy", "killed_mcap"), "mpu6050")
    assert run.pose is not None
    assert (len(run.imu), len(run.pose.stamp_ns)) == (3282, 3282)
    assert "its recorder was killed; read are 6892 messages of 16.4 s" in run.notes[0]


def test_killed_recorder_that_wrote_nothing_is_named() -> None:
    with pytest.raises(BagError, match="empty file"):
        load_run(recordings("rosbag2_jazzy", "killed_early_mcap"), "mpu6050")


def test_humble_bag() -> None:
    run = load_run(recordings("rosbag2_multipose"), "/imu")
    assert len(run.imu) == 17589
    norm = np.linalg.norm(run.imu.specific_force, axis=1)
    assert np.median(norm) == pytest.approx(9.8, abs=0.3)


def test_session_from_another_simulator() -> None:
    run = load_run(recordings("rail_sessions", "session_a", "run_00"), "mpu6050")
    assert run.pose
    assert run.joint
    assert run.temperature
    assert run.battery
    assert (len(run.imu), len(run.pose.stamp_ns), len(run.joint.stamp_ns)) == (6400, 6400, 6400)
    assert len(run.temperature.stamp_ns) == len(run.battery.stamp_ns) == 640
    np.testing.assert_allclose(run.joint.position, run.pose.position, atol=1e-3)


def test_optical_reference() -> None:
    run = load_run(recordings("broad", "10_undisturbed_slow_translation_A"), "broad")
    assert run.mag is not None
    assert run.reference is not None
    assert (len(run.imu), len(run.reference.stamp_ns)) == (55409, 55367)
    np.testing.assert_allclose(np.linalg.norm(run.reference.orientation, axis=1), 1.0, atol=1e-6)
    assert 2e-5 < np.median(np.linalg.norm(run.mag.field, axis=1)) < 8e-5  # tesla
