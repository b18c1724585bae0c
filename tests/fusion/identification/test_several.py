"""A campaign that was recorded into one bag, and bags of more than one unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from tests.study.judge import analyse

from gsense_fusion.bags.run import PoseSeries, Run
from gsense_fusion.identification.recording.integrity import clean_runs
from gsense_fusion.identification.recording.several import runs_of
from gsense_fusion.identification.types import Role

from .sessions import BOW, SETTINGS, made, names


def _joined(series: Sequence[Any]) -> Any:
    if series[0] is None or not hasattr(series[0], "stamp_ns"):
        return series[0]
    parts = [f.name for f in fields(series[0]) if isinstance(getattr(series[0], f.name), np.ndarray)]
    return replace(series[0], **{name: np.concatenate([getattr(s, name) for s in series]) for name in parts})


def _one_bag(runs: Sequence[Run]) -> Run:
    return replace(runs[0], **{f.name: _joined([getattr(r, f.name) for r in runs]) for f in fields(Run)})


def _driven(position: np.ndarray) -> Run:
    """A run of the study with this motion instead of its own, 200 readings a second."""
    run = made().runs[0][0]
    stamps = run.imu.stamp_ns[0] + np.arange(len(position)) * 5_000_000
    return replace(run, joint=None, pose=PoseSeries(stamps, position))


def test_each_motion_of_a_bag_is_a_run() -> None:
    runs = [run for run, _ in made().runs]
    clean = clean_runs([(_one_bag(runs), Role.FIT)])
    still = [run for run in runs if np.ptp(run.encoder.position) < 1e-3]  # type: ignore[union-attr]
    assert len(clean) == len(runs) - len(still)
    assert len({run.name for run in clean}) == len(clean)
    assert sum(run.received for run in clean) == sum(len(run.imu) for run in runs)
    assert any("each is a run of its own" in note for note in clean[0].notes)


def test_one_motion_with_a_move_to_its_start_and_with_dwells_stays_one_run() -> None:
    t = np.arange(0.0, 40.0, 0.005)
    moved = 0.1 * np.clip((t - 1.0) / 3.0, 0.0, 1.0)
    dwelling = np.interp((t - 8.0) % 10.0, [0.0, 3.0, 5.0, 8.0, 10.0], [0.1, -0.1, -0.1, 0.1, 0.1])
    run = _driven(np.where((t > 8.0) & (t < 38.0), dwelling, moved))
    assert runs_of(run) == [run]


@pytest.mark.slow
def test_a_campaign_in_one_bag_says_what_its_runs_say() -> None:
    bowed = made(BOW)
    roles = {role: [run for run, r in bowed.runs if r == role] for _, role in bowed.runs}
    found = analyse(replace(bowed, runs=tuple((_one_bag(runs), role) for role, runs in roles.items())), SETTINGS)
    apart = analyse(bowed, SETTINGS)
    assert names(found) == names(apart) == ["rail_curvature"]
    assert found.rate_rms.full == pytest.approx(apart.rate_rms.full, rel=0.1)


@pytest.mark.slow
def test_bags_of_two_units_are_of_none() -> None:
    bags = made().runs
    mixed = tuple((replace(run, unit_id="A1" if k % 2 else "B2"), role) for k, (run, role) in enumerate(bags))
    result = analyse(replace(made(), runs=mixed), SETTINGS)
    assert result.unit_id is None
    assert any("A1, B2" in note and "by itself" in note for note in result.notes)
