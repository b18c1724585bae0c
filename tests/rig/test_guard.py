"""The guard: its judgement on a virtual clock, and live: whoever is killed at 8 rad/s, the motor stops."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.rig.processes import alive, children, wait_for

from gsense_rig.hardware.sim_memory import SIZE, RailMemory
from gsense_rig.loop.client import LoopProcess
from gsense_rig.loop.messages import DriveSine, Home, Reset
from gsense_rig.loop.spec import ProcessSpec
from gsense_rig.plant.state import POSITION, SPEED
from gsense_rig.safety.modes import Fault, Mode

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def _import_path(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), *sys.path]))


class Run:
    """A loop process in mid-run at 8 rad/s, crossing the centre; its rail lies in a file."""

    def __init__(self, folder):
        self.file = folder / "rail"
        self.telemetry = []
        self.loop = LoopProcess(ProcessSpec(position=0.22, memory=self.file), self.telemetry.append)
        self.loop.wait_ready()
        _, homed = self.loop.request(Home(self.loop.next_id()))
        assert homed.result(60).success
        self.guard = children(self.loop.pid)[0]
        _, self.result = self.loop.request(DriveSine(self.loop.next_id(), 0.15, 8.0, 1000))
        wait_for(lambda: self.telemetry[-1].elapsed > 2.5 and abs(self.telemetry[-1].velocity) > 1.1)

    def rail(self):
        return RailMemory(memoryview(bytearray(self.file.read_bytes()[:SIZE])))


@pytest.fixture
def start(tmp_path):
    """Starts the run within the test, so that its processes inherit the test's captured stderr."""
    runs = []
    yield lambda: runs.append(Run(tmp_path)) or runs[-1]
    for run in runs:
        run.loop.close()
        wait_for(lambda run=run: not alive(run.guard))


@pytest.mark.slow
def test_killed_loop_the_guard_brakes_and_pulls_dis(start, capfd):
    run = start()
    before = run.rail().time
    os.kill(run.loop.pid, signal.SIGKILL)
    wait_for(lambda: not alive(run.guard))  # it ends when the motor is off
    rail = run.rail()
    assert rail.output.disabled
    assert rail.output.duty == 0.0
    assert rail.values[SPEED] == 0.0
    assert abs(rail.values[POSITION]) < 0.22
    assert rail.time > before  # the physics went on after the loop's death
    text = capfd.readouterr().err
    said = re.search(r"no heartbeat of the loop for (\d+) ms: braked from .*, motor off after (\d+) mm", text)
    assert said, text
    assert float(said[1]) <= 20.0
    assert float(said[2]) < 60.0


@pytest.mark.slow
def test_killed_guard_is_noticed_by_the_loop_and_a_reset_brings_another(start):
    run = start()
    os.kill(run.guard, signal.SIGKILL)
    wait_for(lambda: run.telemetry[-1].mode == Mode.FAULT and run.telemetry[-1].disabled)
    assert run.telemetry[-1].fault == Fault.GUARD
    assert "gone" in run.result.result(60).message
    assert abs(run.rail().values[SPEED]) == 0.0
    reply, _ = run.loop.request(Reset(run.loop.next_id()))
    assert reply.result(60).accepted
    wait_for(lambda: run.loop.request(DriveSine(run.loop.next_id(), 0.1, 2.0, 1))[0].result(60).accepted)
    run.guard = children(run.loop.pid)[0]
    assert alive(run.guard)


@pytest.mark.slow
def test_loop_held_up_for_a_while_is_no_silence_in_simulated_time(start):
    run = start()
    os.kill(run.loop.pid, signal.SIGSTOP)
    time.sleep(0.3)
    os.kill(run.loop.pid, signal.SIGCONT)
    count = len(run.telemetry)
    wait_for(lambda: len(run.telemetry) > count + 100)
    assert run.telemetry[-1].mode == Mode.RUNNING


def test_killed_parent_loop_and_guard_end_with_the_motor_off(tmp_path):
    file = tmp_path / "rail"
    command = [sys.executable, "-m", "tests.rig.loop_parent", str(tmp_path / "end.json"), str(file)]
    parent = subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT)
    loop = int(parent.stdout.readline())
    guard = children(loop)[0]
    parent.kill()
    parent.wait()
    parent.stdout.close()
    wait_for(lambda: not alive(loop) and not alive(guard))
    rail = RailMemory(memoryview(bytearray(file.read_bytes()[:SIZE])))
    assert rail.output.disabled
    assert rail.values[SPEED] == 0.0
