"""A short campaign on the live simulated graph: killed in the middle of a run, and finished by the same command."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain"), pytest.mark.timeout(600)]

PLAN = """
runs:
  - {shape: static, duration: 3, role: fit}
  - {shape: sine, amplitude: 0.15, angular_frequency: 6, duration: 4, role: fit}
  - {shape: sine, amplitude: 0.15, angular_frequency: 5, duration: 4, mounting: 180, role: held_out}
"""


def _environment(folder: Path) -> dict[str, str]:
    return {**os.environ, "TMPDIR": str(folder)}


def _command(folder: Path, *more: str) -> list[str]:
    from .processes import executable

    plan = folder / "plan.yaml"
    plan.write_text(PLAN)
    return [str(executable("gsense_rig", "campaign")), str(plan), "--out", str(folder / "out"), *more]


def _done(folder: Path) -> list[str]:
    index = folder / "out" / "index.yaml"
    runs = yaml.safe_load(index.read_text())["runs"] if index.exists() else []
    return [run["bag"] for run in runs if run["state"] == "done"]


def _columns(bag: Path) -> dict[str, np.ndarray]:
    """Per topic, stamps (s) and one quantity."""
    out: dict[str, list[tuple[float, float]]] = {}
    with AnyReader([bag], default_typestore=get_typestore(Stores.ROS2_JAZZY)) as reader:
        for connection, _, raw in reader.messages():
            if connection.topic in ("/rig/pose", "/mpu6050/imu/data_raw", "/rig/state", "/link"):
                m = reader.deserialize(raw, connection.msgtype)
                value = {
                    "/rig/pose": lambda m: m.pose.position.x,
                    "/mpu6050/imu/data_raw": lambda m: m.linear_acceleration.x,
                }
                read = value.get(connection.topic, lambda _: 0.0)
                out.setdefault(connection.topic, []).append(
                    (m.header.stamp.sec % 100_000 + m.header.stamp.nanosec * 1e-9, read(m))
                )
    return {topic: np.array(rows) for topic, rows in out.items()}


def _end_in_motion(folder: Path, number: signal.Signals) -> tuple[int, str]:
    """Starts the campaign and ends it in the motion of its second run; exit code and log."""
    log = folder / f"{number.name}.log"
    with log.open("w") as stderr:
        started = subprocess.Popen(
            _command(folder, "--yes"), env=_environment(folder), start_new_session=True, stderr=stderr
        )
    end = time.monotonic() + 300.0
    try:
        while not (folder / "out" / ".unfinished" / "run_01").exists() or not (folder / "out" / "run_00").exists():
            assert started.poll() is None, log.read_text()
            assert time.monotonic() < end
            time.sleep(0.05)
        time.sleep(4.0)  # at rest for two seconds, then in motion
        started.send_signal(number)
        started.wait(90.0)
    finally:
        started.kill()
        started.wait()
    return started.returncode, log.read_text()


def _wait_for_ends(folder: Path) -> None:
    """Until all processes of a campaign have ended, by themselves where it was killed: they know it by their TMPDIR."""
    end = time.monotonic() + 60.0
    while left := [pid for pid in Path("/proc").glob("[0-9]*") if f"TMPDIR={folder}\0" in _environment_of(pid)]:
        assert time.monotonic() < end, left
        time.sleep(0.05)


def _environment_of(process: Path) -> str:
    try:
        return (process / "environ").read_text(errors="replace") + "\0"
    except OSError:
        return ""  # ended meanwhile, or another user's


def test_a_killed_campaign_is_finished_by_the_same_command(tmp_path: Path) -> None:
    pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace: run by ./rig test")
    code, log = _end_in_motion(tmp_path, signal.SIGINT)
    assert code == 130
    assert log.endswith(f"campaign: interrupted; the same command goes on in {tmp_path / 'out'}\n")
    assert _done(tmp_path) == ["run_00"]
    _wait_for_ends(tmp_path)
    shutil.rmtree(tmp_path / "out" / ".unfinished")
    code, _ = _end_in_motion(tmp_path, signal.SIGKILL)
    assert code == -signal.SIGKILL
    assert _done(tmp_path) == ["run_00"]
    before = (tmp_path / "out" / "run_00" / "run_00_0.mcap").stat().st_mtime_ns
    _wait_for_ends(tmp_path)
    second = subprocess.run(
        _command(tmp_path, "--yes"),
        env=_environment(tmp_path),
        check=False,
        capture_output=True,
        text=True,
        timeout=400,
    )
    assert second.returncode == 0, second.stderr
    assert "2 runs, 1 were there already; 0 of " in second.stdout
    assert _done(tmp_path) == ["run_00", "run_01", "run_02"]
    assert (tmp_path / "out" / "run_00" / "run_00_0.mcap").stat().st_mtime_ns == before
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["index.yaml", "run_00", "run_01", "run_02"]
    for bag, sign, w in (("run_01", 1.0, 6.0), ("run_02", -1.0, 5.0)):
        columns = _columns(tmp_path / "out" / bag)
        assert len(columns["/rig/state"]) > 300
        assert len(columns["/link"]) > 5
        t, s = columns["/rig/pose"].T
        at, force = columns["/mpu6050/imu/data_raw"].T
        assert np.ptp(s[t < t[0] + 1.5]) < 1e-3  # rest before
        felt = np.interp(at, t, s)
        moving = np.abs(felt) > 0.05
        assert np.polyfit(felt[moving], force[moving] - force.mean(), 1)[0] == pytest.approx(-sign * w**2, rel=0.1)


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        ("runs: [{shape: sine, amplitude: 0.3, angular_frequency: 2, duration: 3}]", "leaves the soft limits"),
        ("runs: 7", "has no list `runs:`"),
        ("runs: [", "line 1: not YAML"),
        ("runs: [{shape: sine, amplitude: x, angular_frequency: 2, duration: 3}]", "amplitude 'x' is not a number"),
    ],
)
def test_malformed_plans_are_refused_in_one_line(tmp_path: Path, plan: str, words: str) -> None:
    command = _command(tmp_path)
    (tmp_path / "plan.yaml").write_text(plan)
    done = subprocess.run(command, env=_environment(tmp_path), check=False, capture_output=True, text=True, timeout=120)
    assert done.returncode == 2
    assert words in done.stderr
    assert done.stderr.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_without_a_graph_it_says_what_to_start(tmp_path: Path) -> None:
    done = subprocess.run(
        _command(tmp_path), env=_environment(tmp_path), check=False, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "start the rig node" in done.stderr
