"""How unsure a board's mounting makes the turns of the rig, and what a turned board shows of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.simulator import Disturbance, PlannedRun

from gsense_fusion.identification.effects.base import Drivers
from gsense_fusion.identification.effects.viscous_tilt import ViscousTilt
from gsense_fusion.identification.likelihood.alignment import TOLERANCE, Tolerance
from gsense_fusion.identification.motion.carriage import Kinematics
from gsense_fusion.identification.motion.mounting import Mounting

from .sessions import BASE, SHORT, analysed, finding, made, names

TURNED = (*SHORT, PlannedRun(7.0, 16.0, turned=True), PlannedRun(4.2, 16.0, turned=True), PlannedRun(0.0, 20.0))


def test_a_component_that_is_not_known_may_be_large() -> None:
    group = (np.array([1, 2, 3]),)
    used = np.arange(4)
    known = Tolerance.of(np.array([9.0, 4.0, 0.0, 0.0]), group, used)
    assert known.columns.tolist() == [1, 2, 3]
    assert known.variance == pytest.approx(TOLERANCE**2 * 4.0)
    unknown = Tolerance.of(np.array([9.0, 4.0, 25.0, 0.0]), group, used)
    assert unknown.variance == pytest.approx(TOLERANCE**2 * 29.0)
    assert len(Tolerance.of(np.ones(4), group, np.array([0])).columns) == 0


def test_a_tilt_with_the_speed_rings_as_g_does() -> None:
    """What the accelerometer feels above the drive is in G f: without it the two would be told apart by the belt."""
    t = np.linspace(0.0, 2.0, 401)
    acceleration, ringing = np.sin(6.0 * t), 0.1 * np.sin(190.0 * t)
    kin = Kinematics(0 * t, 0 * t, acceleration, 0 * t)
    mounting = Mounting(np.array([0.0, 0.0, 1.0]), np.array([-0.8, 0.6, 0.0]), 9.81)
    force = 9.81 * mounting.up + np.outer(acceleration + ringing, mounting.along)
    assert ViscousTilt().rate(Drivers(kin, mounting, force, None, t)) == pytest.approx(acceleration + ringing)
    assert ViscousTilt().rate(Drivers(kin, mounting, None, None, t)) == pytest.approx(acceleration)


@pytest.mark.slow
def test_the_turned_board_shows_the_turn_about_the_vertical_and_the_rest_stays_unknown() -> None:
    base = replace(BASE, plan=TURNED, chain=replace(BASE.chain, rate_hz=100.0, filter_hz=42.0))
    tilt = Disturbance("drag_lever", 1e-3)
    session, result = made(tilt, base=base), analysed(tilt, base=base)
    assert (result.verdict, names(result)) == ("effects_found", ["viscous_tilt"]), result.unexplained
    found = finding(result, "viscous_tilt").parameters
    g = result.declared_parameters["g_sensitivity"]
    for axis, true in zip("xyz", tilt.size * session.direction, strict=True):
        assert abs(found[f"c_{axis}"].value - true) < 4 * found[f"c_{axis}"].stderr
    for row, true in zip("xyz", session.g_matrix[:, 0], strict=True):
        assert abs(g[f"g_{row}x"].value - true) < 4 * g[f"g_{row}x"].stderr
    assert found["c_z"].stderr < 0.1 * tilt.size < found["c_x"].stderr
