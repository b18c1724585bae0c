"""What drift alone gains by chance: p-values of drift are uniform, a true step is far out, a temperature too."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.cases import Case, with_disturbances
from tests.study.judge import analyse
from tests.study.simulator import simulate
from tests.study.simulator.parameters import DEG, NoiseParameters
from tests.study.slow_chance import KINDS, best_alternative, session

from gsense_fusion.identification.likelihood.slow import Blocks
from gsense_fusion.identification.search.alternatives import remounted_at, step_places, steps
from gsense_fusion.identification.verdict.motion_drift import motion_walk

SESSIONS = 6


@pytest.mark.parametrize("kind", KINDS)
def test_drift_alone_is_no_slow_effect(kind: str) -> None:
    found = [best_alternative(session(kind, seed, 300.0)) for seed in range(SESSIONS)]
    p = np.array([f.p_value(float(f.gains.max())) for f in found])
    assert p.min() > 1e-3  # the least of six is under it once in 170
    assert p.max() > 0.3


def test_a_step_beyond_drift_is_seen_and_where_it_is() -> None:
    blocks = session("flicker and walk", 3, 300.0)
    middle = len(blocks) // 2
    jump = 0.02 * DEG * (np.arange(len(blocks)) >= middle)
    found = best_alternative(replace(blocks, rate=blocks.rate + jump[:, None] * np.array([1.0, -0.5, 0.2])))
    best = int(np.argmax(found.gains))
    assert step_places(blocks)[best] == middle
    assert found.p_value(float(found.gains[best])) < 1e-4
    assert found.gain_for(1e-3) > found.gain_for(1e-2) > found.gain_for(0.3) > 0


def test_steps_stay_in_their_session() -> None:
    sessions = np.array([0] * 6 + [1] * 6)
    zero = np.zeros(12, dtype=np.int64)
    blocks = Blocks(np.arange(12) * 8.0, np.full(12, 8.0), np.zeros((12, 3)), sessions, zero, zero)
    columns = steps(blocks)
    assert columns.shape == (12, 10)
    assert not columns[6:, :5].any()
    assert not columns[:6, 5:].any()
    few = blocks.part(np.arange(12) < 8)
    assert steps(few).shape == (8, 0)


def test_a_walk_that_runs_in_motion_stands_still_at_rest() -> None:
    blocks = session("white alone", 1, 200.0)
    walk = motion_walk(blocks, np.cumsum(np.where(blocks.run % 2 == 1, blocks.duration, 0.0)))
    resting = np.flatnonzero(blocks.run == 2)
    assert np.ptp(walk[np.ix_(resting, resting)]) == 0.0
    assert walk[resting[0], resting[0]] == pytest.approx(blocks.duration[blocks.run == 1].sum())


@pytest.mark.slow
def test_a_bias_that_wanders_in_motion_is_a_finding_and_one_that_wanders_always_is_none() -> None:
    case = Case("single", ("creep",), 4000.0, 4, 25.0)
    result = analyse(simulate(with_disturbances(case)))
    assert [f.effect for f in result.findings] == ["bias_drift"], result.unexplained
    assert result.verdict == "effects_found"
    q, true = result.findings[0].parameters["q"], with_disturbances(case).disturbances[0].size
    assert abs(q.value - true) < 3 * q.stderr
    noise = replace(NoiseParameters(), markov_tau_s=(1e5,), markov_sigma=(true * np.sqrt(5e4),))
    always = analyse(simulate(replace(with_disturbances(case), disturbances=(), noise=noise)))
    assert always.verdict == "nothing_missing", always.unexplained


def test_a_step_where_the_board_was_mounted_anew_is_no_step_of_the_bias() -> None:
    zero, pose = np.zeros(12, dtype=np.int64), np.array([0] * 6 + [1] * 6)
    blocks = Blocks(np.arange(12) * 8.0, np.full(12, 8.0), np.zeros((12, 3)), zero, zero, pose)
    assert 6 in step_places(blocks)
    assert 6 not in step_places(blocks, remounted=False)
    assert steps(blocks, remounted=False).shape == (12, 10)
    assert [remounted_at(blocks, t) for t in (-1.0, 39.0, 41.0, 47.0, 49.0, 95.0)] == [
        False,
        False,
        True,
        True,
        False,
        False,
    ]
