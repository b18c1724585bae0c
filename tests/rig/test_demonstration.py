"""The demonstration's own logic: what it hides, where it writes, how it judges."""

from __future__ import annotations

import os
import signal

import numpy as np
import pytest
import yaml

from gsense_rig import demo
from gsense_rig.demonstration import start
from gsense_rig.demonstration.domain import busy_domains
from gsense_rig.demonstration.folder import FolderError, open_folder
from gsense_rig.demonstration.hidden import KINDS, HiddenEffect, draw
from gsense_rig.demonstration.live_bag import header_stamp
from gsense_rig.demonstration.orientation import Track, low_passed, orientation_error, read_reference
from gsense_rig.demonstration.outcome import compare
from gsense_rig.demonstration.processes import DemoError, Processes, find_executable
from gsense_rig.sensors.effects import parse_effect


def test_a_seed_repeats_its_effect_and_every_kind_comes():
    drawn = [draw(seed) for seed in range(200)]
    assert drawn == [draw(seed) for seed in range(200)]
    assert {effect.kind for effect in drawn} == set(KINDS)
    assert all(effect.kind.low <= effect.value <= effect.kind.high for effect in drawn)
    assert len({effect.value for effect in drawn}) > 50
    for effect in drawn[:20]:
        assert parse_effect(effect.argument).value == effect.value


def test_a_new_demo_replaces_what_the_last_one_wrote_and_nothing_else(tmp_path):
    folder = open_folder(tmp_path / "demo", 1)
    for path in (folder.live_bag, folder.campaign, folder.report):
        path.mkdir(parents=True)
        (path / "old").write_text("old")
    (folder.log / "rig.log").write_text("old")
    (folder.root / "notes.txt").write_text("mine")
    folder.close()
    again = open_folder(tmp_path / "demo", 2)
    assert sorted(p.relative_to(again.root).as_posix() for p in again.root.rglob("*") if p.name[0] != ".") == [
        "demo.yaml",
        "log",
        "notes.txt",
    ]
    assert yaml.safe_load(again.summary.read_text())["seed"] == 2
    again.close()


def test_two_demos_do_not_share_a_folder(tmp_path):
    first = open_folder(tmp_path / "demo", 1)
    with pytest.raises(FolderError, match="another demo is at work in it"):
        open_folder(tmp_path / "demo", 2)
    first.close()
    open_folder(tmp_path / "demo", 2).close()


@pytest.mark.parametrize("mark", ["", "schema: other/1\n", "[", "7"])
def test_a_folder_of_someone_else_is_refused(tmp_path, mark):
    (tmp_path / "demo.yaml").write_text(mark)
    (tmp_path / "bags").mkdir()
    with pytest.raises(FolderError, match="no demo wrote it"):
        open_folder(tmp_path, 1)
    assert (tmp_path / "bags").is_dir()


def test_domains_of_open_ports():
    assert busy_domains([53, 7399, 7400, 7410, 7650 + 13, 7400 + 250 * 101, 40000]) == {0, 1, 101}


def test_orientation_error_of_known_motion():
    time = np.arange(0.0, 12.0, 0.005)
    tilt = np.where(time < 3.0, 0.0, 0.02 * np.sin(2 * np.pi * (time - 3.0)))  # about x, 1 Hz
    quaternion = np.column_stack([np.cos(tilt / 2), np.sin(tilt / 2), 0 * time, 0 * time])
    turn = np.array([np.cos(0.35), 0.0, 0.0, np.sin(0.35)])  # the heading is no tilt
    w, x, _, _ = quaternion.T
    turned = np.column_stack([turn[0] * w, turn[0] * x, turn[3] * x, turn[3] * w])
    rate = 0.3 + np.column_stack([0.01 * np.sin(2 * np.pi * time), np.sin(2 * np.pi * 20.0 * time), 0 * time])
    error = orientation_error(Track(time, rate, turned), 3.0, 11.0)
    assert error.tilt == pytest.approx(0.02 / np.sqrt(2), rel=1e-3)
    assert error.rate == pytest.approx(0.01 / np.sqrt(6), rel=1e-2)  # the 20 Hz are above the cut-off
    with pytest.raises(ValueError, match="too few"):
        orientation_error(Track(time, rate, turned), 11.9, 12.0)


def test_turning_of_a_bent_rail(tmp_path):
    file = tmp_path / "compensation.yaml"
    terms = "- {effect: rail_curvature, t: [1, 0, 2], u: [0, 3, 0], w3: [0, 0, 4]}"
    file.write_text(f"schema: gsense-compensation/1\nreference:\n{terms}\n")
    reference = read_reference(file)
    time = np.arange(0.0, 1.0, 0.001)
    rate = reference.rate(time, 0.1 * time, 0.1 + 0 * time, np.array([0.5]))
    assert rate == pytest.approx(np.array([[0.1, 2 * 0.05 * 0.1 * 3, 0.2 + 3 * 0.05**2 * 0.1 * 4]]))
    file.write_text("schema: gsense-compensation/1\nterms: []\n")
    assert read_reference(file) is None


def test_low_pass_is_brick_wall():
    time = np.arange(1000) / 100.0
    low, high = np.sin(2 * np.pi * 4.9 * time), np.sin(2 * np.pi * 5.1 * time)
    assert low_passed((low + high)[:, None], 100.0)[:, 0] == pytest.approx(low, abs=1e-9)


@pytest.mark.parametrize(("raw", "order"), [(b"\0\1\0\0", "little"), (b"\0\0\0\0", "big")])
def test_header_stamp(raw, order):
    raw += (1_700_000_000).to_bytes(4, order) + (250_000_000).to_bytes(4, order) + b"rest"
    assert header_stamp(raw) == 1_700_000_000.25


def report(*findings):
    rms = {"raw": 0.02, "declared": 0.01, "full": 0.004, "noise_floor": 0.0038, "unit": "rad/s"}
    return {"verdict": "effects_found", "findings": list(findings), "rate_rms": rms}


def finding(effect, owner, unit, **values):
    parameters = {name: {"value": v, "stderr": e, "unit": unit} for name, (v, e) in values.items()}
    return {"effect": effect, "owner": owner, "parameters": parameters}


def test_comparison_of_what_was_found():
    hidden = HiddenEffect(next(k for k in KINDS if k.name == "time_offset"), 0.012)
    found = compare(report(finding("time_offset", "chain", "s", tau=(0.0126, 0.0003))), hidden)
    assert (found.hidden_found, found.others, found.deviation) == (True, (), pytest.approx(2.0))
    [row] = found.rows
    assert (row.hidden, row.found, row.unit) == ("12", "12.60 +- 0.30", "ms")
    other = finding("temperature_bias", "sensor", "rad/s/K", c_x=(1e-3, 1e-4))
    missed = compare(report(other), hidden)
    assert (missed.hidden_found, missed.others, missed.deviation) == (False, ("temperature_bias",), None)
    assert [row.found for row in missed.rows] == ["not found", "0.0573 +- 0.0057"]


def test_unknown_error_of_an_estimate_is_not_a_deviation():
    hidden = HiddenEffect(next(k for k in KINDS if k.name == "time_offset"), 0.012)
    found = compare(report(finding("time_offset", "chain", "s", tau=(0.0126, None))), hidden)
    assert found.deviation is None
    assert found.rows[0].found == "12.6"


def script(tmp_path, text):
    path = tmp_path / "lib" / "package" / "tool"
    path.parent.mkdir(parents=True)
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return {"AMENT_PREFIX_PATH": str(tmp_path), "PATH": "/usr/bin:/bin"}


def test_a_process_that_ends_is_noticed_with_its_last_line(tmp_path):
    processes = Processes(tmp_path, script(tmp_path, "echo first >&2; echo why >&2; exit 3"))
    child = processes.start("package", "tool", label="name")
    child.process.wait(20)
    with pytest.raises(DemoError, match=r"name ended with exit code 3: why .*name\.log"):
        processes.check()
    processes.check(child)
    assert processes.wait(child, lambda: None, 1.0) == 3
    processes.check()


def test_close_ends_also_what_ignores_every_request(tmp_path, monkeypatch):
    monkeypatch.setattr("gsense_rig.demonstration.processes._POLITE", 0.3)
    monkeypatch.setattr("gsense_rig.demonstration.processes._FIRM", 0.3)
    text = "trap '' INT TERM; echo ready; while :; do sleep 0.1; done"
    processes = Processes(tmp_path, script(tmp_path, text))
    child = processes.start("package", "tool")
    while "ready" not in child.log.read_text():
        processes.check()
    processes.close()
    assert child.process.returncode == -9


def test_missing_executable_is_named(tmp_path):
    with pytest.raises(DemoError, match="no executable 'rig' of package 'gsense_rig'"):
        find_executable("gsense_rig", "rig", {"AMENT_PREFIX_PATH": str(tmp_path)})


def test_a_signal_within_a_binding_ends_it_as_any_other_does(tmp_path, monkeypatch, capsys):
    def interrupted(_folder):
        try:
            os.kill(os.getpid(), signal.SIGTERM)
        except demo.Ended:
            raise RuntimeError("Unable to convert call argument '0' to Python object") from None

    monkeypatch.setattr(start, "processes", interrupted)
    assert demo.main(["--out", str(tmp_path / "demo")]) == 128 + signal.SIGTERM
    assert capsys.readouterr().err == "\ndemo: ended by SIGTERM; all its processes are gone\n"


def test_an_error_without_a_signal_is_no_end(tmp_path, monkeypatch):
    def broken(_folder):
        raise RuntimeError("broken")

    monkeypatch.setattr(start, "processes", broken)
    with pytest.raises(RuntimeError, match="broken"):
        demo.main(["--out", str(tmp_path / "demo")])
