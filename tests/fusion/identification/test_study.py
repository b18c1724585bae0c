"""The study itself: its quick part, what it goes on with after an interruption, the methods beside the engine."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from tests.study.cases import Case, make_cases
from tests.study.judge import Outcome, reachable
from tests.study.peers import peers, same
from tests.study.reference import held_out_rms, measured_rates, true_noise
from tests.study.simulator import Disturbance, PlannedRun, SessionParameters, simulate
from tests.study.simulator.disturbances import MECHANISMS
from tests.study.study import _earlier
from tests.study.table import show, upper_bound

from .sessions import BOW, made

STUDY = Path(__file__).resolve().parents[2] / "study" / "study.py"


@pytest.mark.slow
def test_quick_study_finds_what_is_there_and_nothing_else(tmp_path: Path) -> None:
    command = [sys.executable, str(STUDY), "--quick", "--out", str(tmp_path / "quick.jsonl")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "false alarms on null sessions: 0 of 3" in done.stdout


def test_other_methods_see_the_bow_and_those_without_a_column_for_it_leave_it() -> None:
    session = made(BOW)
    found = peers(session, held_out_rms(session, true_noise(session)))
    for name in ("OLS, nested F-tests", "STLSQ"):
        assert "rail_curvature" in found[name].found
        assert found[name].floor_ratio < 1.3
    assert found["G"].floor_ratio > 2.0
    assert found["thesis's k"].floor_ratio > found["G"].floor_ratio
    assert same(["jerk_coupling"], frozenset({"time_offset"}))


def test_a_broken_line_of_a_killed_study_is_done_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, cases = tmp_path / "outcomes.jsonl", [Case("null", (), 0.0, seed) for seed in (1, 2)]
    path.write_text(json.dumps(asdict(Outcome("null", "null", 0.0, 1))) + '\n{"group": "nu')
    assert [o.seed for o in _earlier(path, cases)] == [1]
    assert "outcomes.jsonl:2" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("named", "left_open", "right"),
    [
        (["time_offset"], ["temperature_bias"], True),
        (["time_offset"], ["supply_voltage"], False),
        (["time_offset"], [], False),
        (["time_offset", "g_squared"], ["temperature_bias"], False),
        ([], ["temperature_bias"], False),
    ],
)
def test_what_is_missing_is_known_to_be_undecided(named: list[str], left_open: list[str], right: bool) -> None:
    truth = frozenset({"temperature_bias", "time_offset"})
    assert reachable([(n, ()) for n in named], truth, frozenset(), frozenset(left_open)) == right
    assert not reachable([(n, ()) for n in named], truth, frozenset())


def test_table_shows_coverage_and_the_other_methods() -> None:
    beside = {"OLS": {"found": ["g_cubed"], "exact": False, "floor_ratio": 1.0}}
    nulls = [Outcome("null", "null", 0.0, i, "nothing_missing", exact=True, peers=beside) for i in range(30)]
    for i, o in enumerate(nulls):
        o.z = {"g_sensitivity g_xx": 0.1 * i}
    console = Console(width=200, record=True)
    show(nulls, console)
    text = console.export_text()
    assert "cover 66.7 % of 30" in text
    assert f"{100 * upper_bound(0, 30):.1f} %" in text
    assert "100 % of 30" in text.split("OLS")[1]


@pytest.mark.parametrize(("kind", "turns"), [("feedthrough", True), ("mount_resonance", True), ("back_emf", False)])
def test_what_the_sensor_makes_of_the_motion_turns_with_the_board(kind: str, turns: bool) -> None:
    """In the sensor's axes the acceleration changes its sign; what the motor puts into the chain does not."""
    time = np.arange(0.0, 4.0, 1e-3)
    speed = np.sin(5.0 * time)
    travel = SimpleNamespace(velocity=speed, acceleration=5.0 * np.cos(5.0 * time))
    made = [
        MECHANISMS[kind](SimpleNamespace(travel=travel, direction=np.ones(3), swayed=sign * travel.acceleration), 1.0)  # type: ignore[arg-type]
        for sign in (1.0, -1.0)
    ]
    assert made[1] == pytest.approx(-made[0] if turns else made[0])


def test_a_tilt_with_the_speed_is_studied_only_with_the_turned_board() -> None:
    sweep, turned = (make_cases(0, 1, plan=plan) for plan in ("sweep", "turned"))
    assert {c.label for c in turned} - {c.label for c in sweep} == {"drag_lever"}
    seeds = {(c.label, c.energy): c.seed for c in turned}
    assert all(seeds[c.label, c.energy] == c.seed for c in sweep)


@pytest.mark.parametrize("disturbances", [(), (Disturbance("creep", 2e-5), Disturbance("speed_noise", 1e-3))])
def test_what_a_complete_model_leaves_holds_earth_rate_and_what_is_drawn(disturbances: tuple[Disturbance, ...]) -> None:
    """Without G the gyro shows nothing else; a model with one bias a session takes neither off."""
    plan = tuple(
        PlannedRun(4.0, 12.0, role=role, turned=turned) for role, turned in (("fit", False), ("held_out", True))
    )
    session = simulate(SessionParameters(3, plan, disturbances, g_matrix=((0.0,) * 3,) * 3))
    left = true_noise(session)
    explained = [rate - noise for rate, noise in zip(measured_rates(session), left, strict=True)]
    assert held_out_rms(session, explained) < 1e-3 * held_out_rms(session, left)
    assert held_out_rms(session, left) > 1.02 * held_out_rms(session, [truth.noise for truth in session.truth])
