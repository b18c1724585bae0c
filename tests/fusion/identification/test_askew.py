"""A board that was put back askew: what gravity's step tells of G is compensated, though it is too little to state."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.study.judge import analyse
from tests.study.simulator import PlannedRun
from tests.study.simulator.parameters import DEG

from gsense_fusion.identification.likelihood.gram import Gram
from gsense_fusion.identification.likelihood.identified import solve
from gsense_fusion.identification.result import LoopResult

from .sessions import BASE, SETTINGS, SHORT, made

ASKEW_DEG = 3.0
TURNED = (
    PlannedRun(3.3, 16.0, turned=True),
    PlannedRun(5.3, 16.0, role="held_out", turned=True),
    PlannedRun(0.0, 30.0, turned=True),
)
PLAN = (*SHORT, *TURNED)
G = np.array([[0.10, 0.17, -0.05], [-0.12, -0.15, 0.08], [0.07, 0.16, 0.04]]) * DEG / 9.80665


@lru_cache
def _analysed(seed: int) -> LoopResult:
    """A session in which the turned board leans to its side, and the gyro feels gravity there through G."""
    rows = tuple((float(x), float(y), float(z)) for x, y, z in G)
    session = made(base=replace(BASE, seed=seed, plan=PLAN, g_matrix=rows))
    lean = Rotation.from_rotvec([ASKEW_DEG * DEG, 0.0, 0.0])
    runs = []
    for planned, (run, role) in zip(PLAN, session.runs, strict=True):
        force = lean.apply(run.imu.specific_force) if planned.turned else run.imu.specific_force
        rate = run.imu.angular_rate + (force - run.imu.specific_force) @ G.T
        runs.append((replace(run, imu=replace(run.imu, angular_rate=rate, specific_force=force)), role))
    return analyse(replace(session, runs=tuple(runs)), SETTINGS)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 5, 8])
def test_the_step_of_gravity_does_not_stay_in_the_error(seed: int) -> None:
    rms = _analysed(seed).rate_rms
    assert rms.noise_floor is not None
    assert rms.full < 1.02 * rms.noise_floor


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 5, 8])
def test_what_is_stated_is_what_compensates_and_its_interval_covers(seed: int) -> None:
    result = _analysed(seed)
    stated = result.declared_parameters["g_sensitivity"]
    value, stderr = (
        np.array([[getattr(stated[f"g_{i}{j}"], what) for j in "xyz"] for i in "xyz"]) for what in ("value", "stderr")
    )
    np.testing.assert_array_equal(value, result.g_matrix)
    assert np.abs(value - G).max() < 3e-4
    assert np.all(np.abs(value - G) < 1.96 * stderr)
    assert stderr[:, 1].min() > 1.5e-4  # the step alone does not identify it


@pytest.mark.parametrize("information", [0.0, 0.1, 4.0, 10.0])
def test_a_direction_that_is_not_identified_is_expected_at_the_posterior_mean(information: float) -> None:
    size, truth = 3e-4, np.array([0.5, 2.0])
    xx = np.diag([1e4, information]) / size**2
    found = solve(Gram(xx, xx @ (truth * size), 0.0, 9), np.arange(2), np.full(2, size))
    assert found.rank == 1
    assert found.part == pytest.approx([0.5 * size, 0.0])
    assert found.expected == pytest.approx([0.5 * size, 2.0 * size * information / (information + 1.0)])
    assert np.sqrt(np.diag(found.covariance)) == pytest.approx([size / 100, size])
    identified = np.diag([1e4, 12.0]) / size**2
    found = solve(Gram(identified, identified @ truth, 0.0, 9), np.arange(2), np.full(2, size))
    np.testing.assert_array_equal(found.expected, found.part)
