"""The recorder as users start it: a process in the graph, ended by a signal, whose bag holds all that was published."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

pytest.importorskip("rclpy", reason="needs the ROS environment: run by ./rig test")

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain")]

ROOT = Path(__file__).resolve().parents[2]
PUBLISHER = Path(__file__).with_name("imu_publisher.py")


@contextmanager
def process(*command: str, cwd: Path) -> Iterator[subprocess.Popen[str]]:
    path = os.pathsep.join([str(ROOT / "src" / "gsense_rig"), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path}
    started = subprocess.Popen(
        [sys.executable, *command], cwd=cwd, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    try:
        yield started
    finally:
        started.kill()
        started.communicate()


def recorder(*parameters: str) -> list[str]:
    arguments = [item for parameter in parameters for item in ("-p", parameter)]
    return ["-m", "gsense_rig.record", "--ros-args", *arguments]


@pytest.mark.parametrize(("how", "count"), [(signal.SIGINT, 100), (signal.SIGTERM, 1000)])
def test_records_every_message_and_closes_on_a_signal(tmp_path: Path, how: signal.Signals, count: int) -> None:
    with process(*recorder("out:=bag"), cwd=tmp_path) as record:
        assert record.stdout is not None
        assert "recording to" in record.stdout.readline()
        with process(str(PUBLISHER), str(count), "200", cwd=tmp_path) as publisher:
            assert publisher.stdout is not None
            assert publisher.stdout.readline() == "first\n"
            assert publisher.stdout.readline() == f"published {count}\n"
            record.send_signal(how)
            out, err = record.communicate(timeout=60)
    assert record.returncode == 0, err
    assert f"{count}  /mpu6050/imu/data_raw" in out
    assert f"{count // 20}  /mpu6050/temperature" in out
    with AnyReader([tmp_path / "bag"], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        imu = [c for c in reader.connections if c.topic == "/mpu6050/imu/data_raw"]
        seen = [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages(imu)]
    assert [m.header.stamp.sec for m in seen] == list(range(count))
    assert [m.angular_velocity.x for m in seen] == [float(k) for k in range(count)]


def test_metadata_is_what_rosbag2_writes(tmp_path: Path) -> None:
    command = recorder("out:=bag", "topics:=['mpu6050/imu/data_raw']")
    with process(*command, cwd=tmp_path) as record, process(str(PUBLISHER), "20", "200", cwd=tmp_path):
        assert record.stdout is not None
        record.stdout.readline()
        assert record.stderr is not None
        while "recording /mpu6050/imu/data_raw" not in record.stderr.readline():
            pass
        record.send_signal(signal.SIGTERM)
        record.communicate(timeout=60)
    data = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert (data["version"], data["storage_identifier"]) == (9, "mcap")
    assert data["relative_file_paths"] == ["bag_0.mcap"]
    [topic] = data["topics_with_message_count"]
    assert topic["topic_metadata"]["name"] == "/mpu6050/imu/data_raw"
    assert topic["topic_metadata"]["type_description_hash"].endswith(
        "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"  # of an installed sensor_msgs 5.3.6
    )
    assert topic["topic_metadata"]["offered_qos_profiles"][0]["reliability"] == "reliable"
    assert sorted(p.name for p in (tmp_path / "bag").iterdir()) == ["bag_0.mcap", "metadata.yaml"]


def test_refuses_an_existing_folder_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    with process(*recorder("out:=bag"), cwd=tmp_path) as record:
        out, err = record.communicate(timeout=60)
    assert record.returncode == 2
    assert out == ""
    assert err.count("\n") == 1
    assert "bag exists already" in err


def numbers(bag: Path) -> list[int]:
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        imu = [c for c in reader.connections if c.topic == "/mpu6050/imu/data_raw"]
        return [reader.deserialize(raw, c.msgtype).header.stamp.sec for c, _, raw in reader.messages(imu)]


def test_a_killed_recorder_loses_less_than_a_second(tmp_path: Path) -> None:
    """SIGKILL in a live stream at 200 Hz: all but the last second is read at once, and by rosbag2 after the repair."""
    from gsense_fusion.bags import load_run

    with process(*recorder("out:=bag"), cwd=tmp_path) as record:
        assert record.stdout is not None
        record.stdout.readline()
        with process(str(PUBLISHER), "700", "200", cwd=tmp_path) as publisher:
            assert publisher.stdout is not None
            assert publisher.stdout.readline() == "first\n"
            time.sleep(3.0)
            killed = time.time_ns()
            record.kill()
            record.wait()
            publisher.stdout.readline()
    run = load_run(tmp_path / "bag", "mpu6050")
    readable = run.imu.received_ns
    assert len(readable) > 200
    assert any("recorder was killed" in note for note in run.notes)
    path = [sys.executable, "-m", "gsense_rig.record", "--repair", "bag"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src" / "gsense_rig") + os.pathsep + os.environ["PYTHONPATH"]}
    done = subprocess.run(path, cwd=tmp_path, env=environment, text=True, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    kept = numbers(tmp_path / "bag")
    assert kept == list(range(len(kept)))
    assert kept[-1] == run.imu.stamp_ns[-1] // 10**9
    pause = np.diff(readable).max()  # by which the machine held up the recorder at its worst; 5 ms where it does not
    assert readable[-1] > killed - 1_000_000_000 - pause


def test_goes_on_when_a_topic_is_late_and_splits(tmp_path: Path) -> None:
    names = "topics:=['mpu6050/imu/data_raw', 'mpu6050/temperature', 'never']"
    with process(*recorder("out:=bag", "max_bag_size:=100000", names), cwd=tmp_path) as record:
        assert record.stdout is not None
        record.stdout.readline()
        time.sleep(1.0)  # nobody publishes yet
        with process(str(PUBLISHER), "1000", "500", cwd=tmp_path) as publisher:
            assert publisher.stdout is not None
            publisher.stdout.readline()
            assert publisher.stdout.readline() == "published 1000\n"
            record.send_signal(signal.SIGINT)
            _, err = record.communicate(timeout=60)
    assert record.returncode == 0
    assert "record: /never: nobody published it" in err
    assert numbers(tmp_path / "bag") == list(range(1000))
    data = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert len(data["files"]) > 2
    assert data["relative_file_paths"] == [f"bag_{k}.mcap" for k in range(len(data["files"]))]


def test_a_full_disk_ends_the_recorder_with_a_closed_bag(tmp_path: Path) -> None:
    """A file system of 5 MB, of which the reserve takes 4: what was written is readable, the rest is counted."""
    mount = ["unshare", "--map-root-user", "--mount", "sh", "-c"]
    small = tmp_path / "small"
    small.mkdir()
    fill = f"mount -t tmpfs -o size=5m none {small} && "
    if subprocess.run([*mount, fill + "true"], check=False, capture_output=True).returncode:
        pytest.skip("this machine allows no mount in a namespace of one's own (unshare --map-root-user --mount)")
    bag = small / "bag"
    command = " ".join([sys.executable, *recorder(f"out:={bag}")])
    script = f"{fill} {{ {command}; code=$?; cp -r {bag} {tmp_path}; exit $code; }}"
    with process("-c", f"import os; os.execvp('unshare', {[*mount, script]})", cwd=tmp_path) as record:
        assert record.stdout is not None
        assert "recording to" in record.stdout.readline()
        with process(str(PUBLISHER), "9000", "2000", cwd=tmp_path):
            _, err = record.communicate(timeout=60)
    assert record.returncode == 1, err
    assert "No space left on device; " in err
    assert "messages are not in the bag" in err
    kept = numbers(tmp_path / "bag")
    assert 500 < len(kept) < 9000
    assert kept == list(range(len(kept)))
