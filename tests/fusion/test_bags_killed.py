"""What a killed recorder leaves: read as far as it is sound, with a note that says how much."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag2 import StoragePlugin

from gsense_fusion.bags import BagError, load_run
from gsense_fusion.bags.gaps import find_gaps

from .bag_data import rail_bag

MCAP = StoragePlugin.MCAP


@pytest.fixture(scope="module", params=["none", "storage"])
def whole(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Path:
    """A bag of several chunks, closed."""
    return rail_bag(6000).write(tmp_path_factory.mktemp("whole") / "bag", MCAP, request.param) / "bag.mcap"


@pytest.mark.parametrize("share", [0.9, 0.6])
def test_a_cut_file_is_read_to_its_last_whole_chunk(whole: Path, tmp_path: Path, share: float) -> None:
    full = load_run(whole, "mpu6050")
    content = whole.read_bytes()
    data = content[: content.rindex(b"\x0f\x04" + bytes(7))]  # without the end
    cut = tmp_path / "bag_0.mcap"
    cut.write_bytes(data[: round(share * len(data))])
    run = load_run(cut, "mpu6050")
    count = len(run.imu)
    assert 0.3 * len(full.imu) < count < len(full.imu)
    np.testing.assert_array_equal(run.imu.angular_rate, full.imu.angular_rate[:count])
    assert f"{cut.name}: its recorder was killed; read are " in run.notes[0]
    assert sorted(p.name for p in tmp_path.iterdir()) == [cut.name]


def test_a_file_that_lacks_only_its_end_is_read_whole(whole: Path, tmp_path: Path) -> None:
    cut = tmp_path / "bag_0.mcap"
    cut.write_bytes(whole.read_bytes()[:-1])
    assert len(load_run(cut, "mpu6050").imu) == 6000


def test_garbage_behind_a_power_cut_is_left_out(whole: Path, tmp_path: Path) -> None:
    content = whole.read_bytes()
    half = round(0.6 * len(content))
    cut = tmp_path / "bag_0.mcap"
    cut.write_bytes(content[:half] + bytes(len(content) - half))
    run = load_run(cut, "mpu6050")
    assert 0 < len(run.imu) < 6000


@settings(max_examples=30, deadline=None)
@given(at=st.integers(0, 3000))
def test_any_cut_in_the_first_chunk_is_refused_in_one_line(tmp_path_factory: pytest.TempPathFactory, at: int) -> None:
    folder = tmp_path_factory.getbasetemp() / "short"
    if not folder.exists():
        rail_bag(20).write(folder)
    cut = tmp_path_factory.mktemp("cut") / "bag_0.mcap"
    cut.write_bytes((folder / "short.mcap").read_bytes()[:at])
    with pytest.raises(BagError) as caught:
        load_run(cut, "mpu6050")
    assert str(cut) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_split_bag_without_metadata_is_read_in_order(tmp_path: Path) -> None:
    """Files 2 and 10: by number, not by name; the last one was only begun."""
    bag = tmp_path / "bag"
    bag.mkdir()
    early, late = rail_bag(800), rail_bag(1000)
    late.messages = [m for m in late.messages if m[1] >= early.messages[-1][1] + 1_000_000]
    shutil.copy(early.write(tmp_path / "early") / "early.mcap", bag / "bag_2.mcap")
    shutil.copy(late.write(tmp_path / "late") / "late.mcap", bag / "bag_10.mcap")
    (bag / "bag_11.mcap").write_bytes(b"")
    run = load_run(bag, "mpu6050")
    assert "no metadata.yaml" in run.notes[0]
    assert "bag_11.mcap: empty" in run.notes[1]
    assert np.all(np.diff(run.imu.received_ns) > 0)
    assert not any("went back" in note for note in run.notes)


@pytest.mark.parametrize(
    ("late", "lost", "missing", "gaps"),
    [
        ({}, (), 0, 0),
        ({50: 0.9, 51: 0.4, 200: 0.7}, (), 0, 0),
        ({}, (30,), 1, 1),
        ({}, (30, 31, 32, 90), 4, 2),
        ({28: 0.8}, (30, 400), 2, 2),
        ({}, tuple(range(100, 151)), 51, 1),
    ],
)
def test_gaps_are_losses_and_not_late_samples(late: dict[int, float], lost: tuple[int, ...], missing: int, gaps: int):
    index = np.arange(1000.0)
    for at, periods in late.items():
        index[at] += periods
    stamps = np.delete(index * 5e6, lost).astype(np.int64)
    found = find_gaps(stamps)
    assert (found.missing, found.count) == (missing, gaps)


def test_repeated_samples_are_not_lost() -> None:
    stamps = np.delete(np.arange(0, 10_000_000_000, 10_000_000), (40, 400))
    assert find_gaps(stamps, repeated=2).missing == 0
    assert find_gaps(stamps, repeated=1).missing == 1
