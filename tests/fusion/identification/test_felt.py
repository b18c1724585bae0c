"""The accelerometer beside the gyro: gravity turns with a carriage that truly turns, and with nothing else."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tests.study.simulator import Disturbance, SessionParameters, simulate, sweep_plan
from tests.study.simulator.energy import scaled
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.identification.analysis import Analysis, Settings
from gsense_fusion.identification.campaign import build_campaign
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.effects.base import Drivers, Templates
from gsense_fusion.identification.effects.rail_curvature import RailCurvature
from gsense_fusion.identification.effects.viscous_tilt import ViscousTilt
from gsense_fusion.identification.engine import analyse
from gsense_fusion.identification.felt.channel import ForceChannel
from gsense_fusion.identification.likelihood.gram import Columns
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.motion.mounting import Mounting
from gsense_fusion.identification.recording.integrity import clean_runs
from gsense_fusion.identification.types import Role

SWEEP = SessionParameters(seed=1, plan=sweep_plan(1), chain=ChainParameters(rate_hz=62.5, filter_hz=20.0))
"""Bow and pick-up act about the rail's x and y axes for the most part: about z gravity does not tell them apart."""
DECIDED = 10.0


@lru_cache(maxsize=8)
def _analysis(*disturbances: Disturbance, base: SessionParameters = SWEEP) -> Analysis:
    session = simulate(replace(base, disturbances=disturbances))
    runs = [(run, Role(role)) for run, role in session.runs]
    return analyse(runs, Settings("mpu6050"), lambda _text, _part: None)


def _rivals(a: Analysis) -> dict[str, list[str]]:
    return {n: a.selection.alternatives(a.claims.full, n) for n in a.claims.names}


def _felt_difference(a: Analysis, one: str, other: str) -> float:
    """How much better than the other the first explains the accelerometer, in twice the log-likelihood."""
    names = [a.selection.with_parts(a.selection.declared | {n}) for n in (one, other)]
    first, second = (a.likelihood.felt.loglik(a.selection.candidate(n).fit) for n in names)
    return 2 * (first - second)


def _drivers() -> Drivers:
    t = np.linspace(0.0, 2.0, 401)
    s, w = 0.15 * np.sin(6.0 * t), 6.0
    v = 0.15 * w * np.cos(w * t)
    mount = Rotation.from_rotvec([0.1, -0.2, 0.3]).as_matrix()
    mounting = Mounting(mount[:, 2], mount[:, 0], 9.81)
    return Drivers(Kinematics(s, v, -(w**2) * s, -(w**2) * v), mounting, None, None, t)


@pytest.mark.parametrize("effect", [RailCurvature(), ViscousTilt()], ids=lambda e: e.name)
def test_felt_is_the_derivative_of_exact_rotations(effect: RailCurvature | ViscousTilt) -> None:
    drivers = _drivers()
    kin, small = drivers.kinematics, 1e-6
    assert drivers.mounting is not None
    mount = drivers.mounting.sensor_from_rail
    assert mount is not None
    design = effect.felt(drivers)
    assert design is not None
    felt = np.asarray(design)
    ahead, gravity = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 9.81])
    for axis in range(3):
        turn = np.outer(effect.angle(drivers), np.eye(3)[axis]) * small
        attitude = Rotation.from_rotvec(turn)
        if effect.along_path:  # the velocity stays along the carriage's own x axis
            acceleration = attitude.apply(ahead) * kin.acceleration[:, None]
            acceleration += np.cross(np.eye(3)[axis] * small, ahead) * (kin.velocity**2)[:, None]
        else:  # gravity alone
            acceleration = np.zeros((len(turn), 3))
        force = attitude.inv().apply(acceleration + gravity)
        still = ahead * (kin.acceleration[:, None] * effect.along_path) + gravity
        assert felt[:, :, axis] == pytest.approx((force - still) @ mount.T / small, abs=1e-3)


@pytest.mark.slow
def test_a_bowed_rail_is_no_pick_up() -> None:
    a = _analysis(Disturbance("rail_curvature", 0.13 * DEG))
    assert _rivals(a) == {"rail_curvature": []}
    assert not a.claims.symptoms
    assert _felt_difference(a, "rail_curvature", "speed_pickup") > DECIDED


def test_a_pick_up_of_the_same_size_is_no_bowed_rail() -> None:
    a = _analysis(Disturbance("back_emf", 0.13 * DEG))
    assert _rivals(a) == {"speed_pickup": []}
    assert not a.claims.symptoms
    assert _felt_difference(a, "speed_pickup", "rail_curvature") > DECIDED


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "other"), [("back_emf", "rail_curvature"), ("rail_curvature", "speed_pickup")])
def test_what_only_the_gyro_sees_stays_undecided(kind: str, other: str) -> None:
    """At a whitened energy of 400 in the gyro gravity turns by less than the accelerometer's noise."""
    a = _analysis(scaled(SWEEP, kind, 400.0)[0])
    rivals = _rivals(a)
    assert len(rivals) == 1
    ((name, listed),) = rivals.items()
    assert {name, *listed} >= {"speed_pickup", "rail_curvature"}
    assert abs(_felt_difference(a, "rail_curvature", "speed_pickup")) < DECIDED
    assert other in {name, *listed}


@pytest.mark.slow
def test_the_accelerometer_measures_the_rail_without_bias() -> None:
    """Over sessions with other boards, mountings and noise: a turn of the rail from the accelerometer alone."""
    z = []
    columns = Columns.of(REGRESSED)
    index = columns.index(frozenset({"rail_curvature"}))
    for seed in range(40, 46):
        bow = Disturbance("rail_curvature", 1.3 * DEG)
        base = replace(SWEEP, seed=seed, plan=sweep_plan(seed, held_out=False), disturbances=(bow,))
        session = simulate(base)
        campaign = build_campaign(clean_runs([(run, Role(role)) for run, role in session.runs]))
        channel = ForceChannel(campaign, DriverSource(campaign), REGRESSED)
        names = frozenset({"rail_curvature", "rail_bend"})
        gram = next(iter(channel.grams(names, Templates()).values()))
        both = columns.index(names)
        unit = columns.plausible[both]
        solved = np.linalg.solve(
            gram.xx[np.ix_(both, both)] * np.outer(unit, unit) + 1e-3 * np.eye(6), unit * gram.xy[both]
        )
        stderr = 1.0 / np.sqrt(np.diag(gram.xx)[index])
        error = solved[:3] * unit[:3] - session.rail_slope
        z.append(error[:2] / np.hypot(stderr[:2], 0.02 * np.abs(session.rail_slope).max()))
    assert np.sqrt(np.mean(np.square(z))) < 1.6
    assert np.abs(np.mean(z, axis=0)).max() < 1.2
