"""Reading generated bags: every storage, every topic, what is odd, what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin

from gsense_fusion.bags import BagError, load_run

from .bag_data import START_NS, BagWriter, header, imu, message, rail_bag, vector

MCAP, SQLITE3 = StoragePlugin.MCAP, StoragePlugin.SQLITE3


@pytest.mark.parametrize(
    ("storage", "compression"),
    [(MCAP, "none"), (MCAP, "file"), (MCAP, "message"), (MCAP, "storage"), (SQLITE3, "none"), (SQLITE3, "file")],
)
def test_every_topic_of_a_run_is_read(tmp_path: Path, storage: StoragePlugin, compression: str) -> None:
    path = rail_bag(400).write(tmp_path / "run_07", storage, compression)
    run = load_run(path, "mpu6050")
    i = np.arange(400.0)
    assert (run.name, run.sensor, run.topic, run.unit_id) == ("run_07", "mpu6050", "/mpu6050/imu/data_raw", "board-3")
    np.testing.assert_array_equal(run.imu.stamp_ns, START_NS + 5_000_000 * np.arange(400))
    np.testing.assert_array_equal(run.imu.received_ns - run.imu.stamp_ns, 400_000)
    np.testing.assert_array_equal(run.imu.angular_rate, np.stack([i, -i, 0.5 * i], axis=1))
    np.testing.assert_array_equal(run.imu.specific_force[:, 0], 0.1 * i)
    assert run.imu.rate_axes == (True, True, True)
    assert run.imu.rate_hz == pytest.approx(200.0)
    assert run.pose
    assert run.joint
    assert run.temperature
    assert run.battery
    assert run.mag
    assert run.link
    np.testing.assert_array_equal(run.pose.position, 0.001 * i)
    np.testing.assert_array_equal(run.joint.velocity, 0.2)
    assert np.isnan(run.joint.effort).all()
    np.testing.assert_allclose(run.temperature.value, 25.0 + 0.01 * i[::20])
    np.testing.assert_allclose(run.battery.value, 3.75)
    np.testing.assert_array_equal(run.mag.field[0], (2e-5, 1e-6, -4e-5))
    assert (run.link.received, run.link.lost) == (380, 3)
    assert run.reference is None
    assert run.notes == ()


@pytest.mark.parametrize("prefix", ["/", "/bench/", "/lab/rail_2/"])
def test_any_namespace(tmp_path: Path, prefix: str) -> None:
    run = load_run(rail_bag(40, prefix).write(tmp_path / "bag"), "mpu6050")
    assert run.topic == f"{prefix}mpu6050/imu/data_raw"
    assert run.pose is not None
    assert run.temperature is not None
    assert run.link is not None


def test_rig_under_another_prefix_than_the_sensor(tmp_path: Path) -> None:
    bag = rail_bag(40, "/")
    for i in range(40):
        at = START_NS + 5_000_000 * i
        bag.add("/board/bno055/imu/data_raw", at, imu(at, (0, 0, 0), (0, 0, 9.8)))
    run = load_run(bag.write(tmp_path / "bag"), "bno055")
    assert run.topic == "/board/bno055/imu/data_raw"
    assert run.pose is not None
    assert run.temperature is None


def test_whole_topic_and_bare_file(tmp_path: Path) -> None:
    bag = BagWriter()
    for i in range(10):
        bag.add("/imu", START_NS + i, imu(START_NS + i * 10**7, (0, 0, i), None))
    path = bag.write(tmp_path / "bag")
    for place, sensor in ((path, "/imu"), (path, "imu"), (path / "bag.mcap", "/imu"), (tmp_path, "/imu")):
        run = load_run(place, sensor)
        assert (run.sensor, len(run.imu)) == ("/imu", 10)
        assert np.isnan(run.imu.specific_force).all()


def test_lisy_has_one_axis(tmp_path: Path) -> None:
    bag = BagWriter()
    variance = np.diag([1e6, 1e6, 1e-4]).ravel()
    for i in range(10):
        at = START_NS + i * 10**7
        bag.add("/lisy300/imu/data_raw", at, imu(at, (0, 0, i), None, angular_velocity_covariance=variance))
    assert load_run(bag.write(tmp_path / "bag"), "lisy300").imu.rate_axes == (False, False, True)


def test_a_board_without_an_accelerometer_takes_that_of_another(tmp_path: Path) -> None:
    bag = BagWriter()
    variance = np.diag([1e6, 1e6, 1e-4]).ravel()
    for i in range(10):
        at = START_NS + i * 10**7
        bag.add("/lab/lisy300/imu/data_raw", at, imu(at, (0, 0, i), None, angular_velocity_covariance=variance))
        bag.add("/lab/mpu6050/imu/data_raw", at, imu(at, (0, 0, 0), (i, 0, 9.8)))
        bag.add("/other/bno055/imu/data_raw", at, imu(at, (0, 0, 0), (0, 0, 1)))
    path = bag.write(tmp_path / "bag")
    beside = load_run(path, "lisy300").beside
    assert beside is not None
    assert np.array_equal(beside.specific_force[:, 0], np.arange(10))
    assert load_run(path, "mpu6050").beside is None


def test_frame_ids_of_changing_length_are_read_message_by_message(tmp_path: Path) -> None:
    bag = BagWriter()
    for i in range(12):
        at = START_NS + i * 10**7
        bag.add("/a/imu/data_raw", at, imu(at, (i, 2 * i, 3 * i), (0, 0, 9.8), frame="x" * (i % 7)))
    run = load_run(bag.write(tmp_path / "bag"), "a")
    np.testing.assert_array_equal(run.imu.angular_rate[:, 2], 3.0 * np.arange(12))


def _imu_bag(path: Path, stamps: list[int]) -> Path:
    bag = BagWriter()
    for i, stamp in enumerate(stamps):
        bag.add("/a/imu/data_raw", START_NS + i * 10**7, imu(stamp, (i, 0, 0), (0, 0, 9.8)))
    return bag.write(path)


def test_stamps_out_of_order_and_repeated(tmp_path: Path) -> None:
    t = [START_NS + k * 10**7 for k in (0, 1, 3, 2, 2, 4)]
    run = load_run(_imu_bag(tmp_path / "bag", t), "a")
    assert list(run.imu.angular_rate[:, 0]) == [0, 1, 3, 2, 5]
    assert np.all(np.diff(run.imu.stamp_ns) > 0)
    assert len(run.notes) == 2
    assert "went back 1 times" in run.notes[0]
    assert "1 repeated" in run.notes[1]


def test_no_stamps_at_all_and_some(tmp_path: Path) -> None:
    run = load_run(_imu_bag(tmp_path / "none", [0] * 5), "a")
    np.testing.assert_array_equal(run.imu.stamp_ns, START_NS + 10**7 * np.arange(5))
    assert "no header stamps" in run.notes[0]
    run = load_run(_imu_bag(tmp_path / "some", [START_NS, 0, START_NS + 5]), "a")
    assert list(run.imu.angular_rate[:, 0]) == [0, 2]
    assert "1 messages without a stamp dropped" in run.notes[0]


def test_samples_that_are_not_numbers_are_dropped(tmp_path: Path) -> None:
    bag = BagWriter()
    for i in range(6):
        at = START_NS + i * 10**7
        bag.add("/a/imu/data_raw", at, imu(at, (float("nan") if i == 2 else i, 0, 0), (0, 0, 9.8)))
    run = load_run(bag.write(tmp_path / "bag"), "a")
    assert list(run.imu.angular_rate[:, 0]) == [0, 1, 3, 4, 5]
    assert "1 samples that are not numbers" in run.notes[0]


def test_pose_of_another_clock_is_not_used(tmp_path: Path) -> None:
    bag = BagWriter()
    for i in range(10):
        at = START_NS + i * 10**7
        bag.add("/a/imu/data_raw", at, imu(at, (0, 0, 0), (0, 0, 9.8)))
        bag.add("/rig/pose", at, message("geometry_msgs/msg/PoseStamped", header=header(i * 10**7 + 10**9)))
    run = load_run(bag.write(tmp_path / "bag"), "a")
    assert run.pose is None
    assert "another clock" in run.notes[0]


def test_counters_survive_a_restart_of_the_driver(tmp_path: Path) -> None:
    bag = BagWriter()
    for i, (received, lost) in enumerate([(100, 4), (300, 5), (20, 1), (220, 1)]):
        at = START_NS + i * 10**9
        bag.add("/a/imu/data_raw", at, imu(at, (0, 0, 0), (0, 0, 9.8)))
        bag.add("/link", at, message("gsense_msgs/msg/LinkStatus", header=header(at), received=received, lost=lost))
    run = load_run(bag.write(tmp_path / "bag"), "a")
    assert run.link is not None
    assert (run.link.received, run.link.lost) == (420, 2)
    assert run.unit_id is None


def test_refusals_name_the_path_and_what_to_do(tmp_path: Path) -> None:
    good = rail_bag(20).write(tmp_path / "one" / "good") if (tmp_path / "one").mkdir() is None else tmp_path
    cases: list[tuple[Path, str, str]] = [
        (tmp_path / "absent", "a", "no such bag"),
        (good, "bno055", "IMU topics there: /mpu6050/imu/data_raw"),
        (good, "/rig/pose", "is a geometry_msgs/msg/PoseStamped"),
    ]
    text = tmp_path / "notes.txt"
    text.write_text("no bag")
    (tmp_path / "empty").mkdir()
    cases += [(text, "a", "not a bag"), (tmp_path / "empty", "a", "not a bag")]
    unclosed = tmp_path / "cut.mcap"
    unclosed.write_bytes((good / "good.mcap").read_bytes()[:200])
    none = tmp_path / "none.mcap"
    none.write_bytes(b"")
    junk = tmp_path / "junk.db3"
    junk.write_bytes(b"this is no database" * 100)
    cases += [(unclosed, "a", "not closed"), (none, "a", "empty file"), (junk, "a", "cannot be opened")]
    wrong = tmp_path / "wrong"
    wrong.mkdir()
    (wrong / "metadata.yaml").write_text("rosbag2_bagfile_information: {version: 9, relative_file_paths: [x_0.mcap]}")
    cases.append((wrong, "a", "x_0.mcap, named in metadata.yaml, is missing"))
    for path, sensor, words in cases:
        with pytest.raises(BagError) as caught:
            load_run(path, sensor)
        assert words in str(caught.value)
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)


def test_two_prefixes_ask_for_the_whole_topic(tmp_path: Path) -> None:
    bag = rail_bag(40, "/left/")
    bag.messages += rail_bag(40, "/right/").messages
    path = bag.write(tmp_path / "bag")
    with pytest.raises(BagError, match="give one whole topic of /left/mpu6050/imu/data_raw, /right/"):
        load_run(path, "mpu6050")
    run = load_run(path, "/right/mpu6050/imu/data_raw")
    assert run.sensor == "mpu6050"
    assert run.notes == ()
    assert run.pose is not None


def test_a_bag_without_imu_and_one_without_messages(tmp_path: Path) -> None:
    bag = BagWriter()
    bag.add("/x/imu/mag", START_NS, message("sensor_msgs/msg/MagneticField", magnetic_field=vector((1, 0, 0))))
    with pytest.raises(BagError, match="no sensor_msgs/msg/Imu topic"):
        load_run(bag.write(tmp_path / "mag"), "x")
    rail_bag(0).write(tmp_path / "none")
    with pytest.raises(BagError, match="no sensor_msgs/msg/Imu topic"):
        load_run(tmp_path / "none", "x")


def test_a_damaged_chunk_is_named(tmp_path: Path) -> None:
    path = rail_bag(2000).write(tmp_path / "bag", MCAP, "storage") / "bag.mcap"
    content = bytearray(path.read_bytes())
    content[content.index(b"zstd") + 5000] ^= 0xFF
    path.write_bytes(content)
    with pytest.raises(BagError, match="damaged, cannot be read to its end") as caught:
        load_run(path, "mpu6050")
    assert str(path) in str(caught.value)


def test_the_magnetometer_of_another_sensor_on_the_board_is_kept_apart(tmp_path: Path) -> None:
    bag = BagWriter()
    for prefix in ("/", "/other/"):
        for i in range(4):
            stamp = START_NS + i * 5_000_000
            bag.add(f"{prefix}lisy300/imu/data_raw", stamp, imu(stamp, (0, 0, i), (0, 0, 9.81)))
    field = message("sensor_msgs/msg/MagneticField", header=header(START_NS), magnetic_field=vector((1e-5, 0, -4e-5)))
    bag.add("/bno055/imu/mag", START_NS, field)
    path = bag.write(tmp_path / "run")
    run = load_run(path, "/lisy300/imu/data_raw")
    assert run.mag is None
    assert run.mag_beside is not None
    np.testing.assert_array_equal(run.mag_beside.field, [(1e-5, 0, -4e-5)])
    assert load_run(path, "/other/lisy300/imu/data_raw").mag_beside is None
