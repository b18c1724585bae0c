"""What the report asks a person to do, for every kind of result."""

from __future__ import annotations

from dataclasses import replace

from tests.fusion import report_results as made

from gsense_fusion.report.html import report_html
from gsense_fusion.report.next_step import COMPLETE, UNEXPLAINED, next_steps
from gsense_fusion.report.words import CORRECTIONS


def test_rivals_are_separated_before_anything_is_corrected() -> None:
    steps = next_steps(made.effects_found())
    assert (
        steps[0]
        == "correct nothing for them before a campaign of next_plan.yaml has told rail_curvature from speed_pickup"
    )
    assert not any(CORRECTIONS[f.owner] in s for f in made.effects_found().findings for s in steps if f.alternatives)


def test_a_sure_finding_says_what_to_correct() -> None:
    finding = replace(made.rail(), alternatives=(), separating_run=None)
    result = replace(made.effects_found(), findings=(finding,), deciding_runs={})
    assert next_steps(result) == [f"for rail_curvature, {CORRECTIONS[finding.owner]}"]


def test_rivals_without_a_run_that_separates_them() -> None:
    finding = replace(made.rail(), separating_run=None)
    steps = next_steps(replace(made.effects_found(), findings=(finding,)))
    assert steps[0] == "correct nothing for them yet: these runs cannot tell rail_curvature from speed_pickup"


def test_nothing_missing_and_what_is_left_open() -> None:
    result = replace(made.nothing_missing(), deciding_runs={})
    assert next_steps(result) == [COMPLETE]
    open_ = replace(result, deciding_runs={"viscous_tilt": "board_turned_90"})
    assert next_steps(open_)[0] == COMPLETE
    assert "undecided_plan.yaml" in next_steps(open_)[1]


def test_unexplained_is_no_order_to_compensate() -> None:
    steps = next_steps(replace(made.only_unexplained(), deciding_runs={}))
    assert steps == [UNEXPLAINED]


def test_it_stands_in_the_head_of_the_page() -> None:
    page = report_html(made.nothing_missing())
    assert COMPLETE[1:] in page.partition("</header>")[0]
