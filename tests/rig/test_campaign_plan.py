"""Plans: the shipped ones, and one-line errors that name file and entry."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gsense_rig.campaign.plan import PlanError, load_plan, parse_plan, shipped_plans
from gsense_rig.control.triangle import Triangle


def test_shipped_plans_are_what_the_contract_names() -> None:
    assert {"minimum", "full", "thesis", "demo"} <= set(shipped_plans())
    minimum, full = load_plan("minimum"), load_plan("full")
    assert len(minimum.runs) == 19
    assert len(full.runs) == 41
    assert 11 * 60 < minimum.duration < 13.5 * 60
    assert 23 * 60 < full.duration < 28 * 60
    strokes = [run for run in minimum.runs if run.shape == "sine" and run.amplitude == 0.15 and run.mounting == "0"]
    assert len({run.angular_frequency for run in strokes}) == 8
    assert sum(run.mounting == "180" and run.shape == "sine" for run in minimum.runs) == 3
    assert {run.position for run in minimum.runs} >= {0.2, -0.2}
    assert {run.angular_frequency for run in load_plan("thesis").runs} - {0} == {2, 4, 5, 7}
    assert {run.mounting for run in full.runs} == {"0", "90", "180", "tilt_x", "tilt_y"}
    for name in shipped_plans():
        assert {run.role for run in load_plan(name).runs} == {"fit", "held_out"}, name


def test_a_plan_file_with_defaults(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("runs:\n  - {shape: sine, amplitude: 0.1, angular_frequency: 3, duration: 10, mounting: 180}\n")
    plan = load_plan(str(file))
    assert plan.name == "mine"
    [run] = plan.runs
    assert (run.mounting, run.role, run.position) == ("180", "fit", 0.0)


SINE = "shape: sine, amplitude: 0.15, angular_frequency: 4, duration: 10"


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("shape: circle, duration: 1", "run 0: shape 'circle' is unknown; use one of sine, triangle, static"),
        ("shape: static", "run 0: duration is missing"),
        ("shape: static, duration: long", "run 0: duration 'long' is not a number"),
        ("shape: static, duration: .nan", "duration nan is not a number"),
        ("shape: static, duration: -1", "duration -1.0 s is not above 0"),
        ("shape: static, duration: 5, position: 0.3", "leaves the soft limits"),
        ("shape: static, duration: 5, amplitude: 0.1", "a static run has no amplitude"),
        (f"{SINE}, mounting: sideways", "mounting 'sideways' is unknown; use one of 0, 90, 180, tilt_x, tilt_y"),
        (f"{SINE}, role: both", "role 'both' is unknown"),
        (f"{SINE}, speed: 3", "'speed' is unknown; use shape"),
        (f"{SINE}, position: 0.05", "a motion is about the centre"),
        ("shape: sine, amplitude: 0.15, angular_frequency: 0, duration: 10", "above 0"),
        ("shape: sine, amplitude: 0.15, angular_frequency: 14, duration: 10", "needs 2.10 m/s; the rig reaches"),
        ("shape: sine, amplitude: 0.05, angular_frequency: 20, duration: 10", "m/s^2; the rig reaches"),
        ("shape: triangle, amplitude: 0.15, angular_frequency: 11, duration: 9", "cannot turn round"),
    ],
)
def test_errors_name_the_entry_in_one_line(tmp_path: Path, entry: str, words: str) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(f"runs:\n  - {{{entry}}}\n")
    with pytest.raises(PlanError) as error:
        load_plan(str(file))
    assert words in str(error.value)
    assert str(file) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", ["", "runs: 3", "runs: []", "[]", "runs:\n  - {shape: [", "runs: [3]"])
def test_what_is_no_plan_is_one_line(text: str) -> None:
    with pytest.raises(PlanError, match="bad") as error:
        parse_plan(text, "bad")
    assert "\n" not in str(error.value)


def test_neither_file_nor_shipped() -> None:
    with pytest.raises(PlanError, match="neither a file nor a shipped plan"):
        load_plan("nowhere")


def test_the_triangle_turns_at_its_amplitude_and_is_consistent() -> None:
    triangle = Triangle(0.15, 4.0, 3)
    assert triangle.duration == pytest.approx(3 * 2 * np.pi / 4, abs=0.05)
    t = np.linspace(0, triangle.duration, 20001)
    s, v, a = np.array([triangle.at(x) for x in t]).T
    assert (s.min(), s.max()) == pytest.approx((-0.15, 0.15), abs=2e-4)
    assert np.gradient(s, t) == pytest.approx(v, abs=1e-4)
    assert np.gradient(v, t)[1:-1] == pytest.approx(a[1:-1], abs=0.1)
    assert np.abs(np.diff(a)).max() < 0.2  # no step that would make the belt ring
    assert np.mean(np.abs(a) < 1e-9) > 0.4  # half of the time at constant speed
