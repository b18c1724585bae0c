"""A bag in whose midst the host's clock was set: its longest part is used, and the run's notes say so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin
from tests.fusion.bag_data import START_NS, BagWriter, header, imu, message, quaternion

from gsense_fusion.bags import load_run
from gsense_fusion.bags.clock_step import longest_part

PERIOD_NS = 10_000_000
SECOND_NS = 10**9


def times(count: int, step_s: float, at: int, follow: int) -> tuple[np.ndarray, np.ndarray]:
    """Stamps and reception; the recorder's clock jumps at row `at`, the stamps `follow` rows later."""
    rows, step = np.arange(count), round(step_s * 1e9)
    true = START_NS + PERIOD_NS * rows
    return true + np.where(rows >= at + follow, step, 0), true + 300_000 + np.where(rows >= at, step, 0)


@pytest.mark.parametrize("follow", [0, 40])
@pytest.mark.parametrize("step_s", [3600.0, -3600.0, 5.0, -5.0, -0.7])
@pytest.mark.parametrize(("at", "first", "last"), [(1400, 0, 1399), (600, 750, 1999)])
def test_the_longest_part_is_found(at: int, first: int, last: int, step_s: float, follow: int) -> None:
    if step_s == 5.0 and follow == 0:  # both jump at the same sample: a silence of the sensor
        return
    stamp, received = times(2000, step_s, at, follow)
    part = longest_part(stamp, received)
    assert part is not None
    rows = part.rows(received)
    assert (rows[0], rows[-1], len(rows)) == (first, last, last - first + 1)
    assert f"set by {step_s:+.1f} s" in part.note
    _, other = times(2000, step_s, at, 0)
    kept = part.rows(other[::3])  # of another topic
    assert abs(3 * kept[0] - first) < 3
    assert abs(3 * kept[-1] - last) < 3
    assert set(np.diff(kept)) == {1}


@pytest.mark.parametrize(
    ("step_s", "storage"), [(5.0, StoragePlugin.MCAP), (-5.0, StoragePlugin.SQLITE3), (-3600.0, StoragePlugin.MCAP)]
)
def test_a_bag_gives_its_longest_part_of_all_topics(tmp_path: Path, step_s: float, storage: StoragePlugin) -> None:
    bag, count, at = BagWriter(), 600, 200
    stamps, received = times(count, step_s, at, 40)
    late, _ = times(count, step_s, at, 80)
    for i in range(count):
        bag.add("/mpu6050/imu/data_raw", int(received[i]), imu(int(stamps[i]), (1e-3 * i, 0, 0), (0, 0, 9.81)))
        position = message("geometry_msgs/msg/Point", x=1e-4 * i)
        pose = message("geometry_msgs/msg/Pose", position=position, orientation=quaternion((1, 0, 0, 0)))
        stamped = message("geometry_msgs/msg/PoseStamped", header=header(int(late[i]), "rail"), pose=pose)
        bag.add("/rig/pose", int(received[i]), stamped)
    run = load_run(bag.write(tmp_path / "run", storage), "mpu6050")
    assert run.pose is not None
    for stamp, number in (
        (run.imu.stamp_ns, 1e3 * run.imu.angular_rate[:, 0]),
        (run.pose.stamp_ns, 1e4 * run.pose.position),
    ):
        assert np.rint(number).tolist() == list(range(at + 150, count))
        assert (stamp == stamps[at + 150 :]).all()
    (note,) = [n for n in run.notes if "clock was set" in n]
    assert f"set by {step_s:+.1f} s in the midst of the run; used is its longest part, 4.0 of 6.0 s" in note


def test_a_pause_a_stall_and_disorder_are_no_steps() -> None:
    true = START_NS + PERIOD_NS * np.arange(3000)
    pause = true + np.where(np.arange(3000) >= 1500, 8 * SECOND_NS, 0)
    assert longest_part(pause, pause + 300_000) is None  # a cable out for 8 s
    stalled = true + 300_000
    stalled[1000:1300] = stalled[1300]  # a host busy for 3 s: all arrives at once
    assert longest_part(true, stalled) is None
    files = np.concatenate([true[2000:], true[:2000]])
    assert longest_part(files, files + 300_000) is None  # files of a bag in another order
    shuffled = np.random.default_rng(1).permutation(true)
    assert longest_part(shuffled, shuffled) is None


def test_messages_without_stamps_are_judged_by_their_reception() -> None:
    received = START_NS + PERIOD_NS * np.arange(1000)
    assert longest_part(np.zeros(1000, np.int64), received) is None
    received[700:] -= 3600 * SECOND_NS
    part = longest_part(np.zeros(1000, np.int64), received)
    assert part is not None
    assert part.rows(received).tolist() == list(range(700))
