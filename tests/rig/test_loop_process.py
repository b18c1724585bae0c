"""The loop in its own process: pipes, pacing, and what happens when somebody dies."""

import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from itertools import pairwise
from pathlib import Path

import pytest
from tests.rig.processes import alive, wait_for
from tests.rig.recording_feed import RecordingFeed, fail

from gsense_rig.hardware.interface import HardwareError
from gsense_rig.loop.client import LoopGone, LoopProcess
from gsense_rig.loop.clock import HostTime, measured_offset_ns
from gsense_rig.loop.messages import DriveSine, Home, Stop
from gsense_rig.loop.pacing import LatenessMeter, Pacer
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.spec import ProcessSpec
from gsense_rig.loop.wire import FrameReader, FrameWriter, PipeClosed
from gsense_rig.safety.modes import Mode
from gsense_rig.safety.monitor import SafetyLimits

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def _import_path(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), *sys.path]))


def test_wire_keeps_order_and_never_blocks_the_sender():
    read_end, write_end = os.pipe()
    writer, reader = FrameWriter(write_end), FrameReader(read_end, blocking=False)
    assert reader.receive() == []
    blob = "x" * 3000
    for k in range(2000):  # 6 MB into a pipe that nobody reads
        writer.send((k, blob))
    got = []
    while len(got) < 2000:
        got += reader.receive()
        writer.flush()
    assert [k for k, _ in got] == list(range(2000))
    assert writer.dropped == 0
    os.close(read_end)
    with pytest.raises(PipeClosed):
        writer.send("nobody there")
    os.close(write_end)


def test_wire_bounds_its_backlog_and_counts_what_it_drops(monkeypatch):
    monkeypatch.setattr("gsense_rig.loop.wire._BACKLOG", 10)
    read_end, write_end = os.pipe()
    writer, reader = FrameWriter(write_end), FrameReader(read_end, blocking=False)
    for k in range(2000):
        writer.send((k, "x" * 3000))
    assert writer.dropped > 0
    got = []
    while True:
        flushed = writer.flush()
        items = reader.receive()
        got += items
        if flushed and not items:
            break
    assert len(got) == 2000 - writer.dropped
    assert [k for k, _ in got] == sorted(k for k, _ in got)
    assert got[-1][0] == 1999
    os.close(read_end)
    os.close(write_end)


def test_pacer_is_absolute_and_catches_up_or_skips():
    simulated = Pacer(100.0, 500.0, catch_up=True)
    late = [simulated.next_due(now) for now in (100.0, 100.5, 100.5)]
    assert late == pytest.approx([100.002, 100.004, 100.006])
    hardware = Pacer(100.0, 500.0, catch_up=False)
    assert [hardware.next_due(now) for now in (100.0, 100.5, 100.5)] == pytest.approx([100.002, 100.5, 100.502])


def test_lateness_is_summed_up_per_report():
    meter = LatenessMeter(0.002)
    for k in range(100):
        meter.note(0.003 if k == 50 else 0.0001, 0.0002)
    health = meter.report()
    assert (health.ticks, health.overruns, health.max_late) == (100, 1, 0.003)
    assert health.mean_cost == pytest.approx(0.0002)
    assert meter.report().max_late == 0.0


def test_host_time_is_constant_but_for_steps():
    offset = measured_offset_ns()
    host = HostTime(offset)
    before, between, after = time.time_ns(), time.monotonic(), time.time_ns()
    assert before - 5_000_000 < host.stamp_ns(between) < after + 5_000_000
    assert not host.check(offset + 300_000)
    assert host.stamp_ns(1.0) == 1_000_000_000 + offset
    assert host.check(offset + 5_000_000)
    assert host.stamp_ns(1.0) == 1_005_000_000 + offset


def test_commands_telemetry_and_history_without_a_hole(tmp_path):
    telemetry, report = [], tmp_path / "end.json"
    parameters = LoopParameters(safety=SafetyLimits(command_timeout=0.5))
    spec = ProcessSpec(parameters, position=0.1, feed_factory=partial(RecordingFeed, report))
    loop = LoopProcess(spec, telemetry.append)
    loop.wait_ready()
    reply, _ = loop.request(DriveSine(loop.next_id(), 0.1, 2.0, 1))
    assert "not homed" in reply.result(60).message
    reply, result = loop.request(Home(loop.next_id()))
    assert reply.result(60).accepted
    os.kill(loop.pid, signal.SIGSTOP)  # the machine is busy elsewhere
    time.sleep(0.8)
    count = len(telemetry)
    os.kill(loop.pid, signal.SIGCONT)
    wait_for(lambda: any(t.mode == Mode.HOMING and abs(t.velocity) > 0.1 for t in telemetry[count:]))
    _, stopped = loop.request(Stop(loop.next_id()))
    assert stopped.result(60).success
    assert not result.result(60).success
    assert loop.close() == 0
    times = [t.time for t in telemetry]
    steps = [b - a for a, b in pairwise(times)]
    assert max(abs(step - 0.005) for step in steps) < 1e-6  # 200 Hz, evenly, without a gap
    end = json.loads(report.read_text())
    assert end["largest_gap"] < 1.001e-3
    assert abs(end["last_speed"]) < 1e-3


def test_parent_killed_in_motion_the_loop_stops_the_motor_and_ends(tmp_path):
    report = tmp_path / "end.json"
    parent = subprocess.Popen(
        [sys.executable, "-m", "tests.rig.loop_parent", str(report)], stdout=subprocess.PIPE, cwd=ROOT
    )
    pid = int(parent.stdout.readline())
    assert alive(pid)
    parent.kill()
    parent.wait()
    parent.stdout.close()
    wait_for(lambda: not alive(pid))
    end = json.loads(report.read_text())
    assert end["peak_speed"] > 0.15
    assert abs(end["last_speed"]) < 1e-3
    assert abs(end["last_current"]) < 0.1


def test_sigterm_stops_the_motor_and_ctrl_c_is_the_parents_business(tmp_path):
    telemetry, ended, report = [], [], tmp_path / "end.json"
    loop = LoopProcess(
        ProcessSpec(position=0.2, feed_factory=partial(RecordingFeed, report)),
        telemetry.append,
        on_end=lambda: ended.append(True),
    )
    loop.wait_ready()
    _, result = loop.request(Home(loop.next_id()))
    wait_for(lambda: any(abs(t.velocity) > 0.2 for t in telemetry))
    os.kill(loop.pid, signal.SIGINT)
    time.sleep(0.05)
    assert alive(loop.pid)
    os.kill(loop.pid, signal.SIGTERM)
    wait_for(lambda: ended)
    assert not result.result(60).success
    assert loop.close() == 0
    assert abs(json.loads(report.read_text())["last_speed"]) < 1e-3


def test_killed_loop_is_noticed_by_its_parent():
    ended = []
    loop = LoopProcess(ProcessSpec(position=0.2), lambda _t: None, on_end=lambda: ended.append(True))
    loop.wait_ready()
    _, result = loop.request(Home(loop.next_id()))
    os.kill(loop.pid, signal.SIGKILL)
    with pytest.raises(LoopGone):
        result.result(60)
    wait_for(lambda: ended)
    assert loop.close() == -signal.SIGKILL


def test_start_failure_reaches_the_parent_in_one_line():
    loop = LoopProcess(ProcessSpec(feed_factory=partial(fail, "effect 'x' is unknown")), lambda _t: None)
    with pytest.raises(HardwareError, match="effect 'x' is unknown"):
        loop.wait_ready()
    assert loop.close() == 2
