"""Slow effects beside something unexplained in the motion: what they rest on decides whether they are claimed."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.analysis import Analysis
from gsense_fusion.identification.engine import analyse
from gsense_fusion.identification.search.alternatives import beside, gravity_columns, motion_offsets, p_beside
from gsense_fusion.identification.types import Role
from gsense_fusion.identification.verdict.courses import courses
from gsense_fusion.identification.verdict.exertion import lingering
from gsense_fusion.identification.verdict.sufficiency import find_symptoms
from gsense_fusion.identification.verdict.vetoes import OPEN_ALPHA, SLOW_ALPHA

from .sessions import SETTINGS, changed, made


def _analysis(*disturbances: Disturbance) -> Analysis:
    runs = [(run, Role(role)) for run, role in made(*disturbances).runs]
    return analyse(runs, SETTINGS, lambda _text, _part: None)


def _p(a: Analysis, name: str, free_motion: bool) -> float:
    return p_beside(a.likelihood, a.declared, name, 0.0, motion_offsets(a.likelihood) if free_motion else None)


@pytest.mark.slow
def test_a_temperature_that_rest_shows_too_is_no_matter_of_the_motion() -> None:
    a = _analysis(Disturbance("temperature_bias", 0.2 * DEG))
    assert a.claims.names == ("temperature_bias",)
    assert _p(a, "temperature_bias", free_motion=True) < SLOW_ALPHA


@pytest.mark.slow
def test_what_moves_the_means_in_motion_alone_is_no_evidence() -> None:
    """Any offset of the runs' motion leaves the chance as it is where motion is free, and only there."""
    a = _analysis(Disturbance("temperature_bias", 0.2 * DEG))
    columns = motion_offsets(a.likelihood)
    offsets = np.random.default_rng(5).normal(0.0, 0.5 * DEG, (columns.shape[1], 3))
    shifted = copy.copy(a.likelihood)
    shifted.blocks = replace(a.likelihood.blocks, rate=a.likelihood.blocks.rate + columns @ offsets)
    before, after = (p_beside(x, a.declared, "temperature_bias", 0.0, columns) for x in (a.likelihood, shifted))
    assert np.log(after) == pytest.approx(np.log(before), rel=1e-3)
    tied = [p_beside(x, a.declared, "temperature_bias", 0.0) for x in (a.likelihood, shifted)]
    assert tied[1] > 10 * tied[0]


@pytest.mark.slow
def test_each_run_has_its_own_offset_while_it_moves() -> None:
    a = _analysis()
    columns = motion_offsets(a.likelihood)
    moving = [w.moving for _, w in a.likelihood.cuts]
    assert columns.sum(axis=1).astype(bool).tolist() == moving
    assert columns.shape[1] == sum(any(w.moving for w in r.windows) for r in a.campaign.fit)


@pytest.mark.slow
def test_what_shaking_leaves_behind_for_seconds_is_no_step() -> None:
    """A bias that recovers in some seconds from being shaken: the rest after a fast run is still off, which is no word
    on a step while it was shaken."""
    a = _analysis()
    shaken = lingering(a.likelihood, a.declared)[:, -1]
    size = 0.4 * DEG / shaken.max() * np.array([1.0, -0.7, 0.8])
    moved = copy.copy(a.likelihood)
    moved.blocks = replace(a.likelihood.blocks, rate=a.likelihood.blocks.rate + shaken[:, None] * size)
    free = motion_offsets(moved)
    both = np.concatenate([free, lingering(moved, a.declared)], axis=1)
    assert p_beside(moved, a.declared, "bias_jump", 0.0, both) > OPEN_ALPHA


@pytest.mark.slow
def test_what_gravity_does_to_a_board_mounted_anew_is_no_step() -> None:
    """The board is tilted by 12 degrees for the last runs: a G across the rail, which they hardly identify, makes a
    step there."""
    session = made()
    starts = sorted(run.imu.stamp_ns[0] for run, _ in session.runs)
    tilt = np.deg2rad(12.0)
    tilted = np.array([[1, 0, 0], [0, np.cos(tilt), np.sin(tilt)], [0, -np.sin(tilt), np.cos(tilt)]])

    def mounted_anew(run: Run, role: str) -> tuple[Run, str]:
        late = run.imu.stamp_ns[0] >= starts[-3]
        force = run.imu.specific_force @ tilted.T if late else run.imu.specific_force
        return replace(run, imu=replace(run.imu, specific_force=force)), role

    runs = [(run, Role(role)) for run, role in changed(session, mounted_anew).runs]
    a = analyse(runs, SETTINGS, lambda _text, _part: None)
    free = gravity_columns(a.likelihood, a.declared)
    assert free.shape[1] == 1
    size = 0.1 * DEG / np.ptp(free) * np.array([1.0, -0.7, 0.8])
    moved = copy.copy(a.likelihood)
    moved.blocks = replace(a.likelihood.blocks, rate=a.likelihood.blocks.rate + free * size)
    tried = courses(moved)
    tied, left = beside(moved, a.declared, tried.columns), beside(moved, a.declared, tried.columns, free)
    assert tied.p_value(float(tied.gains.max())) < SLOW_ALPHA
    assert left.p_value(float(left.gains.max())) > OPEN_ALPHA
    assert "course" not in {s.kind for s in find_symptoms(moved, a.declared, [])}
    assert gravity_columns(_analysis().likelihood, a.declared).shape[1] == 0
