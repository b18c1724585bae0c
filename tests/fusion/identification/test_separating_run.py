"""The run that separates rivals: one that can, and that is not there already."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import yaml

from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.outcome.findings import separating_run
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.report.next_plan import SEPARATING_RUNS, next_plan, undecided_plan
from gsense_rig.campaign.plan import parse_plan

ONCE, TURNED, QUARTER = (1.0, 0.0, 0.0), (-1.0, 0.02, 0.0), (0.01, 1.0, 0.0)
LEVEL, ON_ITS_SIDE = (0.0, 0.0, 1.0), (0.0, 1.0, 0.02)


def _session(*mountings: tuple[tuple[float, float, float], tuple[float, float, float]]) -> Any:
    runs = [SimpleNamespace(mounting=SimpleNamespace(along=np.array(a), up=np.array(u))) for a, u in mountings]
    effects = {e.name: e for e in CATALOGUE}
    return SimpleNamespace(selection=SimpleNamespace(effects=effects), campaign=SimpleNamespace(fit=runs))


def test_a_board_that_was_turned_need_not_be_turned_again() -> None:
    once, turned = _session((ONCE, LEVEL)), _session((ONCE, LEVEL), (TURNED, LEVEL))
    assert separating_run(once, "belt_tilt", ["jerk_coupling"]) == "board_turned_180"
    assert separating_run(turned, "belt_tilt", ["jerk_coupling"]) == "board_turned_90"
    assert separating_run(turned, "belt_tilt", []) is None
    quarter, side = (_session((ONCE, LEVEL), (TURNED, LEVEL), m) for m in ((QUARTER, LEVEL), (ONCE, ON_ITS_SIDE)))
    assert separating_run(quarter, "belt_tilt", ["jerk_coupling"]) == "board_turned_90"
    assert separating_run(side, "belt_tilt", ["jerk_coupling"]) is None


def test_what_the_sensor_makes_of_a_force_turns_with_the_board() -> None:
    once, turned = _session((ONCE, LEVEL)), _session((ONCE, LEVEL), (TURNED, LEVEL))
    assert separating_run(once, "time_offset", ["jerk_coupling"]) == "board_turned_90"
    assert separating_run(turned, "jerk_coupling", ["time_offset"]) == "board_turned_90"
    assert separating_run(once, "time_offset", ["jerk_coupling", "belt_tilt"]) == "board_turned_180"
    assert separating_run(_session((ONCE, LEVEL), (QUARTER, LEVEL)), "time_offset", ["jerk_coupling"]) is None


def _planned(deciding_runs: dict[str, str], *findings: SimpleNamespace) -> str | None:
    result = cast(LoopResult, SimpleNamespace(findings=findings, deciding_runs=deciding_runs))
    plans = next_plan(result), undecided_plan(result)
    assert None in plans
    return plans[0] if findings else plans[1]


def test_what_is_left_open_is_planned_where_the_rig_can_make_its_run_by_itself() -> None:
    left_open = {"viscous_tilt": "board_turned_90", "supply_voltage": "supply_toggled", "bias_drift": "long_rest"}
    plan = _planned(left_open)
    assert plan is not None
    runs = parse_plan(plan, "next").runs
    assert {run.mounting for run in runs} == {"0", "tilt_x"}
    assert max(run.duration for run in runs) <= 60.0
    head = [line for line in plan.splitlines() if line.startswith("#")]
    assert head[0] == "# decides viscous_tilt"
    assert "# supply_voltage is left open: supply_toggled would decide" in head
    assert _planned({"supply_voltage": "supply_toggled", "bias_drift": "long_rest"}) is None


def test_what_rivals_ask_for_decides_others_too() -> None:
    rivals = SimpleNamespace(effect="bias_jump", alternatives=("temperature_bias",), separating_run="long_rest")
    plan = _planned({"bias_drift": "long_rest"}, rivals)
    assert plan is not None
    assert plan.startswith("# separates bias_jump or temperature_bias\n# decides bias_drift\n")
    assert [run.duration for run in parse_plan(plan, "next").runs] == [60.0, 7200.0]


def test_the_board_is_laid_on_its_side_where_the_rig_may_turn() -> None:
    def mountings(effect: str, rival: str) -> set[str]:
        plan = _planned({}, SimpleNamespace(effect=effect, alternatives=(rival,), separating_run="board_turned_90"))
        assert plan is not None
        return {run.mounting for run in parse_plan(plan, "next").runs}

    assert mountings("jerk_coupling", "belt_tilt") == {"0", "tilt_x"}
    assert mountings("time_offset", "jerk_coupling") == {"0", "90"}


def test_every_separating_run_is_a_plan_that_the_rig_can_run() -> None:
    for name, runs in SEPARATING_RUNS.items():
        assert len(parse_plan(yaml.safe_dump({"runs": runs}), name).runs) == len(runs)
