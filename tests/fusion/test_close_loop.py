"""The command `close_loop`: its files, its schema, its one-line refusals, effects of one's own."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from tests.fusion.rail_run import rail_run

from gsense_fusion.close_loop import main
from gsense_fusion.compensation.model import load_compensation
from gsense_fusion.report.next_plan import REST, SEPARATING_RUNS
from gsense_rig.campaign.plan import parse_plan

PICKUP = 2e-3  # (rad/s)/(m/s) on y, the truth that the user's effect has to find

OWN_EFFECT = """
from gsense_fusion.identification.effects.base import Effect, per_axis, spec
from gsense_fusion.identification.types import Owner


class BackEmf(Effect):
    name = "speed_pickup"
    owner = Owner.CHAIN
    equation = "c v"
    source = "test"
    parameters = spec("c_x c_y c_z", "(rad/s)/(m/s)", 1e-3)

    def missing(self, drivers):
        return None if drivers.kinematics.velocity.any() else "no motion along a rail"

    def design(self, drivers):
        return per_axis(drivers.kinematics.velocity)
"""


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    folder = tmp_path_factory.mktemp("bags")
    return [str(rail_run(folder, n, w, lambda v: PICKUP * v)) for n, w in enumerate((0.0, 3.0, 6.0, 8.0, 5.0))]


def test_files_and_schema(bags: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    effects = tmp_path / "mine.py"
    effects.write_text(OWN_EFFECT)
    out = tmp_path / "report"
    assert main(["--fit", *bags[:4], "--held-out", bags[4], "--effects", str(effects), "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    report = json.loads((out / "report.json").read_text())
    assert report["schema"] == "gsense-close-loop/1"
    assert report["sensor"] == "mpu6050"
    assert report["verdict"] == "effects_found"
    assert [f["effect"] for f in report["findings"]] == ["speed_pickup"]
    found = report["findings"][0]["parameters"]["c_y"]
    assert found["value"] == pytest.approx(PICKUP, abs=4 * found["stderr"])
    assert found["stderr"] < 0.05 * PICKUP
    # in one mounting a twisted rail makes the same rate; a turned board tells them apart
    assert report["findings"][0]["alternatives"] == ["rail_curvature"]
    assert report["findings"][0]["separating_run"] == "board_turned_180"
    assert {r["mounting"] for r in yaml.safe_load((out / "next_plan.yaml").read_text())["runs"]} == {0, 180}
    assert [r["role"] for r in report["runs"]] == ["fit"] * 4 + ["held_out"]
    assert report["runs"][4]["angular_frequency"] == pytest.approx(5.0, abs=0.001)
    rms = report["rate_rms"]
    assert rms["full"] < 0.5 * rms["declared"] < rms["raw"]
    assert "temperature_bias could not be decided: no temperature topic" in report["undecided"]
    assert "speed_pickup" in printed
    assert str(out / "report.html") in printed
    compensation = load_compensation(out / "compensation.yaml")
    assert compensation.sensor == "mpu6050"
    assert np.array(compensation.terms[0].full_matrix)[0, 0] == pytest.approx(2e-4, rel=0.05)  # type: ignore[union-attr]
    assert yaml.safe_load((out / "compensation.yaml").read_text())["schema"] == "gsense-compensation/1"


def test_one_run_in_motion_is_enough_for_what_is_declared(bags: list[str], tmp_path: Path) -> None:
    assert main(["--fit", bags[0], bags[2], "--held-out", bags[4], "--out", str(tmp_path)]) == 0
    g = json.loads((tmp_path / "report.json").read_text())["declared_parameters"]["g_sensitivity"]["g_xx"]
    assert g["significant"]
    matrix = np.array(load_compensation(tmp_path / "compensation.yaml").terms[0].full_matrix)  # type: ignore[union-attr]
    assert matrix[0, 0] == pytest.approx(2e-4, abs=4 * g["stderr"])


@pytest.mark.slow
def test_without_the_effect_its_likeness_is_found(bags: list[str], tmp_path: Path) -> None:
    assert main(["--fit", *bags[:4], "--held-out", bags[4], "--out", str(tmp_path)]) == 0
    report = json.loads((tmp_path / "report.json").read_text())
    # the rail's twist is the same rate in one mounting, and the commoner thing
    assert [f["effect"] for f in report["findings"]] == ["rail_curvature"]
    assert report["findings"][0]["parameters"]["t_y"]["value"] == pytest.approx(PICKUP, rel=0.1)
    assert report["findings"][0]["alternatives"] == ["speed_pickup"]
    assert (tmp_path / "next_plan.yaml").exists()


@pytest.mark.parametrize("name", SEPARATING_RUNS)
def test_the_campaign_can_make_what_is_asked_for_next(name: str) -> None:
    plan = parse_plan(yaml.safe_dump({"runs": [REST, *SEPARATING_RUNS[name]]}), name)
    assert len(plan.runs) == 1 + len(SEPARATING_RUNS[name])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--fit", "/nowhere/bag"], "/nowhere/bag: no such bag"),
        (["--fit", "BAG", "--sensor", "nose"], "no sensor 'nose' in this bag; IMU topics there: /mpu6050/imu/data_raw"),
        (["--fit", "BAG", "--held-out", "BAG"], "a run that is fitted cannot judge"),
        (["--fit", "BAG", "BAG"], "named twice"),
        (["--fit", "BAG", "--declared", "luck"], "--declared luck: no such effect; known are "),
        (["--fit", "BAG", "--latitude", "50"], "belong together"),
        (["--fit", "BAG", "--latitude", "500", "--rail-azimuth", "0"], "degrees from -90 to 90"),
        (["--fit", "BAG", "--effects", "/nowhere/mine.py"], "/nowhere/mine.py: not a Python file"),
    ],
)
def test_refuses_in_one_line(
    bags: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    out = tmp_path / "report"
    assert main([bags[1] if a == "BAG" else a for a in arguments] + ["--out", str(out)]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("close_loop: ")
    assert words in lines[0]
    assert not out.exists()


def test_a_broken_effects_file_is_named(bags: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = tmp_path / "broken.py"
    broken.write_text("import nothing_like_this\n")
    assert main(["--fit", bags[1], "--effects", str(broken), "--out", str(tmp_path / "o")]) == 2
    assert f"{broken}: ModuleNotFoundError" in capsys.readouterr().err
    broken.write_text("x = 1\n")
    assert main(["--fit", bags[1], "--effects", str(broken), "--out", str(tmp_path / "o")]) == 2
    assert "defines no subclass" in capsys.readouterr().err
