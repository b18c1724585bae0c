"""The recorder as users start it: a process in the graph, ended by a signal, whose bag holds all that was published."""

from __future__ import annotations

import errno
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

from gsense_rig.recording.bag import BagWriter, offered_qos, storage_file
from gsense_rig.recording.typestore import typestore
from gsense_rig.recording.writer_thread import BagThread, Topic

pytest.importorskip("rclpy", reason="needs the ROS environment: run by ./rig test")

ROOT = Path(__file__).resolve().parents[2]
PUBLISHER = Path(__file__).with_name("imu_publisher.py")


@contextmanager
def process(*command: str, cwd: Path) -> Iterator[subprocess.Popen[str]]:
    path = os.pathsep.join([str(ROOT / "src" / "gsense_rig"), os.environ.get("PYTHONPATH", "")])
    domain = str(120 + os.getpid() % 80)  # of its own: other graphs on this machine are not ours
    environment = {**os.environ, "PYTHONPATH": path, "ROS_DOMAIN_ID": domain}
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


@pytest.mark.graph
@pytest.mark.parametrize(("how", "count"), [(signal.SIGINT, 100), (signal.SIGTERM, 1000)])
def test_records_every_message_and_closes_on_a_signal(tmp_path: Path, how: signal.Signals, count: int) -> None:
    with process(*recorder("out:=bag"), cwd=tmp_path) as record:
        assert record.stdout is not None
        assert "recording to" in record.stdout.readline()
        with process(str(PUBLISHER), str(count), "200", cwd=tmp_path) as publisher:
            assert publisher.stdout is not None
            assert publisher.stdout.readline() == f"published {count}\n"
            record.send_signal(how)
            out, err = record.communicate(timeout=30)
    assert record.returncode == 0, err
    assert f"{count}  /mpu6050/imu/data_raw" in out
    assert f"{count // 20}  /mpu6050/temperature" in out
    with AnyReader([tmp_path / "bag"], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        imu = [c for c in reader.connections if c.topic == "/mpu6050/imu/data_raw"]
        seen = [reader.deserialize(raw, c.msgtype) for c, _, raw in reader.messages(imu)]
    assert [m.header.stamp.sec for m in seen] == list(range(count))
    assert [m.angular_velocity.x for m in seen] == [float(k) for k in range(count)]


@pytest.mark.graph
def test_metadata_is_what_rosbag2_writes(tmp_path: Path) -> None:
    command = recorder("out:=bag", "topics:=['mpu6050/imu/data_raw']")
    with process(*command, cwd=tmp_path) as record, process(str(PUBLISHER), "20", "200", cwd=tmp_path):
        assert record.stdout is not None
        record.stdout.readline()
        assert record.stderr is not None
        while "recording /mpu6050/imu/data_raw" not in record.stderr.readline():
            pass
        record.send_signal(signal.SIGTERM)
        record.communicate(timeout=30)
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


@pytest.mark.graph
def test_refuses_an_existing_folder_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    with process(*recorder("out:=bag"), cwd=tmp_path) as record:
        out, err = record.communicate(timeout=30)
    assert record.returncode == 2
    assert out == ""
    assert err.count("\n") == 1
    assert "bag exists already" in err


def fill(thread: BagThread, topic: str, count: int) -> None:
    for k in range(count):
        thread.put(topic, 1_000_000 * k, b"\0\1\0\0" + bytes(1000))


def test_full_disk_leaves_a_closed_bag_and_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk has room for 3 MB beside the reserve: what was written before is readable, the rest is counted."""
    bag = tmp_path / "bag"
    room = [3_000_000]
    really = os.write

    def write(descriptor: int, data: memoryview) -> int:
        if (bag / ".reserve").exists():
            if len(data) > room[0]:
                if room[0] == 0:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                data = data[: room[0]]
            room[0] -= len(data)
        return really(descriptor, data)

    monkeypatch.setattr(os, "write", write)
    thread = BagThread(bag, typestore())
    thread.add_topic(Topic("/raw", "std_msgs/msg/String", (offered_qos(10),)))
    fill(thread, "/raw", 6000)
    summary = thread.finish()
    assert summary.error is not None
    assert "No space left on device" in summary.error
    assert summary.counts["/raw"] + summary.unwritten == 6000
    assert summary.counts["/raw"] > 2500
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        times = [t for _, t, _ in reader.messages()]
    assert times == [1_000_000 * k for k in range(summary.counts["/raw"])]


def test_sorted_blocks_are_the_same_bag_as_single_messages(tmp_path: Path) -> None:
    store = typestore()
    for name in ("single", "blocks"):
        with BagWriter(tmp_path / name / "bag") as writer:
            a, b = (writer.add_connection(t, "std_msgs/msg/String", typestore=store) for t in ("/a", "/b"))
            messages = [((a, b)[k % 3 == 0], 1000 + k // 2, bytes([k % 251]) * (k % 700)) for k in range(9000)]
            if name == "single":
                for message in messages:
                    writer.write(*message)
            else:
                for at in range(0, 9000, 700):
                    writer.write_sorted(messages[at : at + 700])
    with (
        AnyReader([tmp_path / "single" / "bag"], default_typestore=store) as one,
        AnyReader([tmp_path / "blocks" / "bag"], default_typestore=store) as two,
    ):
        assert [(c.topic, t, raw) for c, t, raw in one.messages()] == [
            (c.topic, t, raw) for c, t, raw in two.messages()
        ]
    metadata = [(tmp_path / name / "bag" / "metadata.yaml").read_text() for name in ("single", "blocks")]
    assert metadata[0] == metadata[1]
    assert storage_file(tmp_path / "single" / "bag").is_file()
