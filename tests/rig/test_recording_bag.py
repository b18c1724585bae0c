"""The bag's writer: what stands in its files, on a full disk, split, killed and repaired."""

from __future__ import annotations

import errno
import os
import shutil
import struct
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_typestore

from gsense_rig.recording.bag import RESERVE_FILE, BagWriter, offered_qos, storage_file
from gsense_rig.recording.interleave import Stream, interleave
from gsense_rig.recording.repair import RepairError, repair
from gsense_rig.recording.typestore import typestore
from gsense_rig.recording.writer_thread import BagThread, Topic

STRING = "std_msgs/msg/String"
STORE = get_typestore(Stores.ROS2_JAZZY)


def information(bag: Path) -> dict[str, Any]:
    return yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]


def topics(bag: Path) -> list[dict[str, Any]]:
    return [topic["topic_metadata"] for topic in information(bag)["topics_with_message_count"]]


def contents(bag: Path) -> list[tuple[str, int, bytes]]:
    with AnyReader([bag], default_typestore=STORE) as reader:
        return [(c.topic, t, bytes(raw)) for c, t, raw in reader.messages()]


def type_hashes(file: Path) -> dict[str, str]:
    """Of each topic, from the channels of a closed file's summary: where rosbag2's reindexer looks."""
    data, at, found = file.read_bytes(), 8, {}
    while at + 17 < len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        if opcode == 0x04:
            topic, begin = _string(data, at + 9 + 4)
            _, begin = _string(data, begin)
            entries, begin = [], begin + 4
            while begin < at + 9 + length:
                entry, begin = _string(data, begin)
                entries.append(entry)
            found[topic] = dict(zip(entries[::2], entries[1::2], strict=True))["topic_type_hash"]
        at += 9 + length
    return found


def _string(data: bytes, at: int) -> tuple[str, int]:
    end = at + 4 + int.from_bytes(data[at : at + 4], "little")
    return data[at + 4 : end].decode(), end


def fill(thread: BagThread, topic: str, count: int, first: int = 0) -> None:
    for k in range(first, first + count):
        thread.put(topic, 1_000_000 * k, b"\0\1\0\0" + k.to_bytes(4, "little") + bytes(996))


@pytest.fixture
def disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A bag's path on a disk that has room for 3 MB beside the reserve."""
    bag = tmp_path / "bag"
    room = [3_000_000]
    really = os.write

    def write(descriptor: int, data: memoryview) -> int:
        if (bag / RESERVE_FILE).exists():
            if len(data) > room[0]:
                if room[0] == 0:
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                data = data[: room[0]]
            room[0] -= len(data)
        return really(descriptor, data)

    monkeypatch.setattr(os, "write", write)
    return bag


@pytest.mark.parametrize("max_bytes", [0, 1_500_000])
def test_full_disk_leaves_a_closed_bag_and_one_line(disk: Path, max_bytes: int) -> None:
    """What was written before is readable, the rest is counted."""
    thread = BagThread(disk, typestore(), max_bytes=max_bytes)
    thread.add_topic(Topic("/raw", STRING, (offered_qos(10),)))
    fill(thread, "/raw", 6000)
    summary = thread.finish()
    assert summary.error is not None
    assert "No space left on device" in summary.error
    assert summary.counts["/raw"] + summary.unwritten == 6000
    assert summary.counts["/raw"] > 2500
    assert [t for _, t, _ in contents(disk)] == [1_000_000 * k for k in range(summary.counts["/raw"])]
    assert information(disk)["custom_data"] == {"gsense.unwritten": str(summary.unwritten)}


def test_a_bag_that_is_removed_meanwhile_is_said(tmp_path: Path) -> None:
    thread = BagThread(tmp_path / "bag", typestore())
    thread.add_topic(Topic("/raw", STRING, (offered_qos(10),)))
    fill(thread, "/raw", 10)
    shutil.rmtree(tmp_path / "bag")
    end = time.monotonic() + 60.0
    while thread.error is None:
        assert time.monotonic() < end
        time.sleep(0.01)
    summary = thread.finish()
    assert summary.error == f"{tmp_path / 'bag'}: writing failed: its file is gone, the bag was moved or removed"
    assert (summary.counts, summary.unwritten) == ({"/raw": 0}, 10)


def test_a_queue_that_is_full_drops_and_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk stalls: what no longer fits into memory is counted by topic, and the bag says so."""
    bag = tmp_path / "bag"
    free = threading.Event()
    really = os.write
    monkeypatch.setattr(os, "write", lambda descriptor, data: (free.wait(20.0), really(descriptor, data))[1])
    thread = BagThread(bag, typestore(), max_queue=2_000_000)
    thread.add_topic(Topic("/raw", STRING, (offered_qos(10),)))
    fill(thread, "/raw", 6000)  # one chunk of 1 MB in the writer's hand, 2 MB in the queue
    free.set()
    end = time.monotonic() + 60.0
    while thread._taken < thread._put and time.monotonic() < end:
        time.sleep(0.01)
    fill(thread, "/raw", 100, first=6000)
    summary = thread.finish()
    assert summary.error is None
    assert 1900 < summary.counts["/raw"] - 100 < 3200
    assert summary.overflow == {"/raw": 6100 - summary.counts["/raw"]}
    assert summary.unwritten == 0
    assert contents(bag)[-1][1] == 6099 * 1_000_000
    assert information(bag)["custom_data"] == {"gsense.overflow": str(summary.overflow["/raw"])}


def test_splits_by_size_and_every_file_stands_alone(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    thread = BagThread(bag, typestore(), max_bytes=1_000_000)
    for name in ("/a", "/b"):
        thread.add_topic(Topic(name, STRING, (offered_qos(10),)))
    fill(thread, "/a", 2500)
    thread.add_topic(Topic("/late", STRING, (offered_qos(10),)))
    fill(thread, "/late", 2500, first=2500)
    assert thread.finish().counts == {"/a": 2500, "/b": 0, "/late": 2500}
    data = information(bag)
    names = [storage_file(bag, k).name for k in range(len(data["files"]))]
    assert len(names) > 3
    assert data["relative_file_paths"] == names == sorted(p.name for p in bag.glob("*.mcap"))
    assert data["message_count"] == sum(file["message_count"] for file in data["files"]) == 5000
    assert [t for _, t, _ in contents(bag)] == [1_000_000 * k for k in range(5000)]
    total = 0
    for name in names:
        assert (bag / name).stat().st_size < 2_200_000
        with Reader(bag / name) as reader:
            assert {"/a", "/b"} <= {c.topic for c in reader.connections}
            total += reader.message_count
        assert set(type_hashes(bag / name).values()) == {STORE.hash_rihs01(STRING)}
    assert total == 5000


@settings(max_examples=10, deadline=None)
@given(counts=st.lists(st.integers(0, 900), min_size=1, max_size=4), seed=st.integers(0, 99))
def test_blocks_are_the_same_bag_as_single_messages(
    tmp_path_factory: pytest.TempPathFactory, counts: list[int], seed: int
) -> None:
    folder = tmp_path_factory.mktemp("blocks")
    rng = np.random.default_rng(seed)
    streams = [
        Stream(k + 1, np.sort(rng.integers(1, 300, n)), rng.integers(0, 255, (n, 700 * (k + 1)), dtype=np.uint8))
        for k, n in enumerate(counts)
    ]
    for name in ("single", "blocks"):
        with BagWriter(folder / name / "bag") as writer:
            connections = [writer.add_connection(f"/{s.channel}", STRING, typestore=STORE) for s in streams]
            if name == "blocks":
                for block in interleave(streams):
                    writer.write_block(block)
                continue
            messages = [
                (time, s.channel, row.tobytes())
                for s in streams
                for time, row in zip(s.log_ns.tolist(), s.rows, strict=True)
            ]
            for time, channel, data in sorted(messages, key=lambda m: m[:2]):
                writer.write(connections[channel - 1], time, data)
    one, two = folder / "single" / "bag", folder / "blocks" / "bag"
    assert contents(one) == contents(two)
    assert (one / "metadata.yaml").read_text() == (two / "metadata.yaml").read_text()


def killed(tmp_path: Path, max_bytes: int = 0) -> tuple[Path, list[tuple[str, int, bytes]]]:
    """What stands on disk of a bag that is being written, and what had been written by then."""
    writer = BagWriter(tmp_path / "whole" / "bag", max_bytes)
    writer.open()
    writer.reserve()
    connections = [
        writer.add_connection(name, STRING, typestore=STORE, offered_qos_profiles=[offered_qos(7)])
        for name in ("/a", "/b")
    ]
    for k in range(4000):
        writer.write(connections[k % 2], 1_000_000 * k, b"\0\1\0\0" + k.to_bytes(4, "little") + bytes(996))
    bag = tmp_path / "bag"
    shutil.copytree(tmp_path / "whole" / "bag", bag)
    writer.close()
    return bag, contents(tmp_path / "whole" / "bag")


@pytest.mark.parametrize("max_bytes", [0, 1_300_000])
@pytest.mark.parametrize("cut", [0, 5000])
def test_a_killed_bag_is_repaired(tmp_path: Path, max_bytes: int, cut: int) -> None:
    bag, everything = killed(tmp_path, max_bytes)
    last = max(bag.glob("*.mcap"), key=lambda file: file.stat().st_mtime_ns)
    with last.open("r+b") as file:
        file.truncate(last.stat().st_size - cut if last.stat().st_size > cut else 0)
    done = repair(bag, typestore())
    kept = contents(bag)
    assert kept == everything[: len(kept)]
    assert sum(file.kept for file in done) == len(kept) > 2000
    assert sorted(p.suffix for p in bag.iterdir() if p.name != "metadata.yaml") == [".mcap"] * len(
        list(bag.glob("*.mcap"))
    )
    data = information(bag)
    assert data["message_count"] == len(kept) == sum(t["message_count"] for t in data["topics_with_message_count"])
    assert topics(bag) == topics(tmp_path / "whole" / "bag")
    for storage in bag.glob("*.mcap"):
        assert type_hashes(storage) == dict.fromkeys(("/a", "/b"), STORE.hash_rihs01(STRING))
    before = [p.read_bytes() for p in sorted(bag.iterdir())]
    assert all(file.left_out is None for file in repair(bag, typestore()))
    assert [p.read_bytes() for p in sorted(bag.iterdir())] == before


def test_repair_refuses_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(RepairError, match=r"no folder with \.mcap files"):
        repair(tmp_path / "absent", typestore())
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "bag_0.mcap").write_bytes(b"")
    with pytest.raises(RepairError, match="nothing in it can be read"):
        repair(tmp_path / "bag", typestore())
    assert (tmp_path / "bag" / "bag_0.mcap").exists()


@pytest.mark.parametrize("name", ["killed_mcap", "mcap", "reindexed_mcap"])
def test_repairs_what_jazzys_own_recorder_left(tmp_path: Path, name: str) -> None:
    home = Path(os.environ.get("GSENSE_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
    source = home / "rosbag2_jazzy" / name
    if not source.is_dir():
        pytest.skip(f"recording rosbag2_jazzy/{name} is not here (set GSENSE_DATA to the folder of recordings)")
    bag = tmp_path / "bag"
    bag.mkdir()
    for file in source.glob("*.mcap"):
        shutil.copyfile(file, bag / file.name)
    repair(bag, typestore())
    assert len(contents(bag)) == {"killed_mcap": 6892}.get(name, 4073)
    theirs = {
        t["topic_metadata"]["name"]: t["topic_metadata"] for t in information(source)["topics_with_message_count"]
    }
    for topic in information(bag)["topics_with_message_count"]:
        ours = topic["topic_metadata"]
        assert ours["type_description_hash"] == theirs[ours["name"]]["type_description_hash"]
        assert ours["type"] == theirs[ours["name"]]["type"]
