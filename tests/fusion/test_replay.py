"""`replay`: what it writes, the definitions of its accuracy, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import Reader
from scipy.spatial.transform import Rotation

from gsense_fusion import replay
from gsense_fusion.attitude.accuracy import (
    AccuracyError,
    Reference,
    aligned,
    at_samples,
    reference_of,
    resting,
    score,
)
from gsense_fusion.attitude.errors import heading_error, inclination_error, total_error
from gsense_fusion.attitude.rest import is_rest
from gsense_fusion.bags import load_run
from gsense_fusion.bags.imu_message import build_imu, packed, parse_imu, with_attitude
from gsense_fusion.compensation import CompensationFile, GSensitivity, write_compensation

from .bag_data import START_NS, STORE, BagWriter, header, imu, message, quaternion, recordings, vector

G = 9.80665


def wxyz(turn: Rotation) -> Any:
    return turn.as_quat()[..., [3, 0, 1, 2]]


NED = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
"""East-north-up to north-east-down."""


def turning_bag(path: Path, mounted: Rotation, n: int = 2400, mag: bool = True, ahrs: Rotation | None = None) -> Path:
    """8 s at rest, then it turns; the reference's body is `mounted` against the sensor's.

    With `ahrs` the reference is an Imu's orientation in an earth frame that this rotation leads to.
    """
    bag, rng = BagWriter(), np.random.default_rng(3)
    turn, dt = Rotation.from_rotvec([0.1, -0.2, 0.3]), 0.005
    for i in range(n):
        at = START_NS + 5_000_000 * i
        rate = np.zeros(3) if i < 1600 else np.array([0.8, 0.5, -0.6]) * np.sin(0.01 * (i - 1600))
        turn = turn * Rotation.from_rotvec(rate * dt)
        force = turn.inv().apply([0, 0, G]) + rng.normal(size=3) * 0.01
        bag.add("/x/imu/data_raw", at + 300_000, imu(at, rate + 0.01, force, "board"))
        if mag and i % 10 == 0:
            field = vector(turn.inv().apply([0.0, 2e-5, -4e-5]))
            bag.add(
                "/x/imu/mag",
                at + 200_000,
                message("sensor_msgs/msg/MagneticField", header=header(at), magnetic_field=field),
            )
        if ahrs is not None:
            other = imu(at, rate, force)
            other.orientation = quaternion(wxyz(ahrs * turn * mounted))
            other.orientation_covariance = np.zeros(9) if i > 20 else other.orientation_covariance
            bag.add("/vectornav/imu", at + 400_000, other)
        elif i % 2 == 0:
            pose = message(
                "geometry_msgs/msg/Pose",
                position=message("geometry_msgs/msg/Point"),
                orientation=quaternion(wxyz(turn * mounted)),
            )
            bag.add("/reference/pose", at, message("geometry_msgs/msg/PoseStamped", header=header(at), pose=pose))
    return bag.write(path)


def read(bag: Path) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    with Reader(bag) as reader:
        for connection, _, data in reader.messages():
            found.setdefault(connection.topic, []).append(STORE.deserialize_cdr(data, connection.msgtype))
    return found


@pytest.mark.parametrize("frame", ["enu", "ned"])
def test_another_sensors_orientation_as_reference(tmp_path: Path, frame: str) -> None:
    mounted, turned = Rotation.from_rotvec([0.4, -0.3, 2.0]), NED if frame == "ned" else Rotation.identity()
    by_pose, by_imu = turning_bag(tmp_path / "a", mounted), turning_bag(tmp_path / "b", mounted, ahrs=turned)
    arguments = ["--sensor", "x", "--filters", "vqf", "--no-bag"]
    named = ["--reference", "/vectornav/imu", "--reference-frame", frame]
    assert replay.main([str(by_pose), *arguments, "--out", str(tmp_path / "pose")]) == 0
    assert replay.main([str(by_imu), *arguments, *named, "--out", str(tmp_path / "imu")]) == 0
    found = [
        json.loads((tmp_path / name / "accuracy.json").read_text())["filters"]["vqf"]["raw"] for name in ("pose", "imu")
    ]
    assert found[1]["inclination_rms"] < 0.5
    assert found[1] == pytest.approx(found[0], abs=0.02)
    if frame == "ned":  # taken for east-north-up, the vertical turns the other way
        assert replay.main([str(by_imu), *arguments, *named[:2], "--out", str(tmp_path / "wrong")]) == 0
        wrong = json.loads((tmp_path / "wrong" / "accuracy.json").read_text())["filters"]["vqf"]["raw"]
        assert wrong["total_rms"] > 5.0


def test_a_reference_without_orientation_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = turning_bag(tmp_path / "in", Rotation.identity(), n=100)
    code = replay.main([str(bag), "--sensor", "x", "--reference", "/x/imu/data_raw", "--out", str(tmp_path / "out")])
    assert code == 2
    assert "reports no orientation" in capsys.readouterr().err


@pytest.mark.parametrize(
    "mounted", [Rotation.identity(), Rotation.from_rotvec([0, 0, np.pi / 2]), Rotation.from_rotvec([0.4, -0.3, 2.0])]
)
def test_bag_and_accuracy(tmp_path: Path, capsys: pytest.CaptureFixture[str], mounted: Rotation) -> None:
    bag = turning_bag(tmp_path / "in", mounted)
    file = tmp_path / "c.yaml"
    write_compensation(file, CompensationFile("x", terms=(GSensitivity(k=1e-4),)))
    out = tmp_path / "out"
    arguments = [str(bag), "--sensor", "x", "--filters", "madgwick", "bounded", "--compensation", str(file)]
    assert replay.main([*arguments, "--out", str(out)]) == 0
    document = json.loads((out / "accuracy.json").read_text())
    assert document["schema"] == "gsense-accuracy/1"
    assert set(document["filters"]) == {"madgwick", "bounded"}
    for both in document["filters"].values():
        assert set(both) == {"raw", "gcomp"}
        for values in both.values():
            assert set(values) == {"inclination_rms", "heading_rms", "total_rms"}
            assert values["total_rms"] < 0.6
    topics = read(out / "bag")
    assert set(topics) == {f"/x/{name}{end}/imu/data" for name in ("madgwick", "bounded") for end in ("", "_gcomp")}
    first = topics["/x/madgwick_gcomp/imu/data"]
    assert len(first) == 2400
    assert first[5].header.frame_id == "board"
    assert first[5].header.stamp.nanosec == (START_NS + 25_000_000) % 10**9
    assert first[5].orientation_covariance[8] < 1
    run = load_run(bag, "x")
    rate = first[7].angular_velocity
    expected = run.imu.angular_rate[7] - 1e-4 * run.imu.specific_force[7][[1, 2, 0]]
    np.testing.assert_allclose([rate.x, rate.y, rate.z], expected, atol=1e-15)
    assert first[7].linear_acceleration.z == run.imu.specific_force[7, 2]
    printed = capsys.readouterr().out
    assert "2400 samples, 0 missing" in printed
    assert "magnetometer used" in printed


def test_without_a_field_the_heading_is_taken_out(tmp_path: Path) -> None:
    run = load_run(turning_bag(tmp_path / "in", Rotation.identity(), mag=False), "x")
    result = replay.replay(run, ["bounded"])
    assert np.degrees(result.accuracy["bounded"]["raw"].total) < 0.6


def test_no_bag_and_no_reference(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    bag = BagWriter()
    for i in range(400):
        bag.add("/x/imu/data_raw", START_NS + 5_000_000 * i, imu(START_NS + 5_000_000 * i, (0, 0, 0), (0, 0, G)))
    out = tmp_path / "out"
    assert replay.main([str(bag.write(tmp_path / "in")), "--sensor", "x", "--no-bag", "--out", str(out)]) == 0
    assert not list(out.iterdir())
    assert "no accuracy: the bag has neither /reference/pose nor rig/*" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--filters", "kalmann"], "no filter 'kalmann'; there are: "),
        (["--filters", "rig_aided"], "rig_aided needs rig/joint_states"),
        (["--sensor", "y"], "no sensor 'y' in this bag"),
        (["--compensation", "nowhere.yaml"], "nowhere.yaml: cannot be read"),
    ],
)
def test_what_cannot_be_used_is_one_line_and_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], more: list[str], words: str
) -> None:
    bag = BagWriter()
    for i in range(300):
        bag.add("/x/imu/data_raw", START_NS + 5_000_000 * i, imu(START_NS + 5_000_000 * i, (0, 0, 0), (0, 0, G)))
    path = bag.write(tmp_path / "in")
    assert replay.main([str(path), "--sensor", "x", *more, "--out", str(tmp_path / "out")]) == 2
    errors = capsys.readouterr().err
    assert errors.count("\n") == 1
    assert words in errors
    assert not (tmp_path / "out").exists()


def test_the_sensors_own_fusion_is_scored(tmp_path: Path) -> None:
    bag = BagWriter()
    for i in range(1600):
        at = START_NS + 5_000_000 * i
        bag.add("/mpu6050/imu/data_raw", at, imu(at, (0, 0, 0), (0, 0, G)))
        place = message("geometry_msgs/msg/Point", x=0.001 * max(i - 1000, 0))
        pose = message("geometry_msgs/msg/Pose", position=place, orientation=quaternion((1, 0, 0, 0)))
        bag.add("/rig/pose", at, message("geometry_msgs/msg/PoseStamped", header=header(at, "rail"), pose=pose))
        own = imu(at, (0, 0, 0), (0, 0, G))
        own.orientation_covariance[0] = 0.0
        own.orientation.x, own.orientation.w = np.sin(0.0005 * max(i - 1000, 0)), np.cos(0.0005 * max(i - 1000, 0))
        bag.add("/mpu6050/imu/data", at, own)
    result = replay.replay(load_run(bag.write(tmp_path / "in"), "mpu6050"), ["gyro_only"])
    # from the 1000th sample on the carriage moves without a turn, and the sensor says that it turns
    by_filter = replay.replay(load_run(tmp_path / "in", "mpu6050"), ["own"])
    assert set(by_filter.accuracy) == {"own"}
    assert by_filter.accuracy["own"]["raw"].inclination == pytest.approx(
        result.accuracy["own"]["raw"].inclination, rel=1e-6
    )
    assert np.degrees(result.accuracy["own"]["raw"].inclination) == pytest.approx(
        np.degrees(0.6 / np.sqrt(3)), rel=0.05
    )


def test_imu_messages_both_ways() -> None:
    made = imu(START_NS + 7, (1, 2, 3), (4, 5, 6), "frame")
    data = bytes(STORE.serialize_cdr(made, made.__msgtype__))
    parsed = parse_imu(data)
    assert (parsed.stamp_ns, parsed.frame, parsed.rate, parsed.force) == (
        START_NS + 7,
        b"frame\0",
        (1, 2, 3),
        (4, 5, 6),
    )
    assert build_imu(parsed.stamp_ns, parsed.frame, *parsed.values) == data
    covariance = range(20, 29)
    turned = with_attitude(parsed, [0.5, 0.1, 0.2, 0.3], packed(covariance), [7.0, 8.0, 9.0])
    values = (0.1, 0.2, 0.3, 0.5, *covariance, 7.0, 8.0, 9.0, *parsed.values[16:])
    assert turned == build_imu(parsed.stamp_ns, parsed.frame, *values)
    with pytest.raises(ValueError, match="Imu"):
        parse_imu(data[:100])


def test_reference_between_its_samples_and_none_over_gaps() -> None:
    stamps = np.array([0, 10, 20, 200], dtype=np.int64) * 1_000_000
    turns = wxyz(Rotation.from_rotvec([[0, 0, 0], [0, 0, 0.01], [0, 0, 0.02], [0, 0, 0.2]]))
    found = at_samples(np.array([5, 20, 100, 300]) * 1_000_000, stamps, turns)
    np.testing.assert_allclose(found[0], wxyz(Rotation.from_rotvec([0, 0, 0.005])), atol=1e-9)
    np.testing.assert_allclose(found[1], turns[2])
    assert np.isnan(found[2:]).all()


def test_only_what_follows_the_first_motion_is_scored() -> None:
    stamps = np.arange(2000) * 5_000_000
    moving = np.arange(2000) >= 1500
    truth = np.tile([1.0, 0, 0, 0], (2000, 1))
    reference = reference_of(stamps, truth, moving)
    assert reference.rest.sum() == 1001
    assert reference.scored.sum() == 500
    off = np.zeros(2000)
    off[1001:1500], off[1500:] = 0.5, np.radians(2.0)
    turns = np.outer(off, [1, 0, 0])
    turns += (0.05, 0.02, 0.1)
    found = wxyz(Rotation.from_rotvec(turns))
    a = score(found, reference, has_heading=True)
    assert np.degrees(a.inclination) == pytest.approx(2.0, rel=0.01)
    with pytest.raises(AccuracyError, match="no motion"):
        reference_of(stamps, truth, np.zeros(2000, dtype=bool))
    with pytest.raises(AccuracyError, match="no rest"):
        reference_of(stamps, truth, np.ones(2000, dtype=bool))
    assert isinstance(reference, Reference)


def test_a_score_is_that_of_the_aligned_attitudes() -> None:
    rng = np.random.default_rng(4)
    n = 3000
    truth, off = rng.normal(size=(n, 3)) * 2, rng.normal(size=(n, 3)) * 0.3
    turns = Rotation.from_rotvec(truth)
    reference = Reference(wxyz(turns), np.arange(n) < 500, np.arange(n) % 7 > 1)
    reference.orientation[~(reference.rest | reference.scored)] = np.nan
    found = wxyz(Rotation.from_rotvec(off) * turns * Rotation.from_rotvec([0.1, 0.2, 0.3]))
    a = score(found, reference, has_heading=False)
    ours, true = aligned(found, reference, has_heading=False)[reference.scored], reference.orientation[reference.scored]
    for value, error in ((a.inclination, inclination_error), (a.heading, heading_error), (a.total, total_error)):
        assert value == pytest.approx(float(np.sqrt(np.mean(error(ours, true) ** 2))), rel=1e-12)
    assert a.samples == len(true)


def test_the_sieve_of_still_seconds_loses_none() -> None:
    rng = np.random.default_rng(6)
    n = 8000
    loud = np.repeat(rng.uniform(0.0, 2.0, n // 400), 400)[:, None]
    rate = rng.normal(size=(n, 3)) * np.radians(1.0) * loud + 0.05
    force = rng.normal(size=(n, 3)) * 0.3 * loud + [0, 0, 9.8]
    force[2000:2500] = np.nan
    stamps = np.arange(n) * 5_000_000
    expected = np.zeros(n, dtype=bool)
    for start in range(0, n - 199, 50):
        expected[start : start + 200] |= is_rest(rate[start : start + 200], force[start : start + 200])
    assert 1000 < expected.sum() < 7000
    np.testing.assert_array_equal(resting(stamps, rate, force), expected)


@pytest.mark.data
@pytest.mark.slow
def test_broad_our_filter_beside_vqf() -> None:
    """Measured: fast translation. 1.1 is the target over four trials (bench fusion_accuracy)."""
    run = load_run(recordings("broad", "15_undisturbed_fast_translation_A"), "broad")
    accuracy = replay.replay(run, ["vqf", "bounded", "madgwick"]).accuracy
    inclination = {name: np.degrees(found["raw"].inclination) for name, found in accuracy.items()}
    assert inclination["vqf"] == pytest.approx(0.37, abs=0.02)
    assert inclination["bounded"] < 1.1 * inclination["vqf"]
    assert inclination["madgwick"] > 1.5
