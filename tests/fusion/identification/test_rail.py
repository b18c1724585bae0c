"""A rail whose attitude is any function of position, and what must not be taken for one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from tests.study.reference import held_out_rms, true_noise
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.compensation import rail_power
from gsense_fusion.identification.effects.base import Drivers, parts_of
from gsense_fusion.identification.effects.rail_curvature import wave
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.report.outputs import compensation

from .sessions import BASE, BOW, analysed, finding, made, names

WAVY = replace(BASE, rail_shape="wavy")


def test_a_wavy_rail_is_one_finding_and_nothing_is_left() -> None:
    result, session = analysed(BOW, base=WAVY), made(BOW, base=WAVY)
    assert (result.verdict, names(result)) == ("effects_found", ["rail_curvature"]), result.unexplained
    assert result.rate_rms.full < 1.05 * held_out_rms(session, true_noise(session))
    parameters = finding(result, "rail_curvature").parameters
    assert {"t_x", "u_x"} < set(parameters)
    powers = {rail_power(name.split("_")[0]) for name in parameters}
    assert max(p for p in powers if p is not None) > 2
    assert all(p.stderr > 0 for p in parameters.values())  # what was not bought is not reported
    (term,) = compensation(result).reference
    assert {rail_power(key) for key in term.parameters} == powers
    assert set(result.covariances["rail_curvature"].parameters) == set(parameters)


def test_an_even_rail_needs_no_further_terms() -> None:
    assert {n[0] for n in finding(analysed(BOW), "rail_curvature").parameters} == {"t", "u"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "size", "name"),
    [
        ("brush_current", 0.04, "friction_pickup"),
        ("back_emf", 0.05, "speed_pickup"),
        ("bearing_play", 0.004, "reversal_rock"),
    ],
)
def test_what_follows_direction_or_speed_is_no_wavy_rail(kind: str, size: float, name: str) -> None:
    result = analysed(Disturbance(kind, size * DEG), base=replace(BASE, chain=ChainParameters(rate_hz=100.0)))
    (found,) = result.findings
    assert name in (found.effect, *found.alternatives)
    assert not any(n.startswith("w") for n in found.parameters if n != "width")


def test_the_rate_of_a_term_is_the_derivative_of_its_angle() -> None:
    time = np.linspace(0.0, 2.0, 2001)
    spline = CubicSpline(time, 0.15 * np.sin(3.0 * time))
    kin = Kinematics(*(spline(time, k) for k in range(4)))
    drivers = Drivers(kin, None, None, None, time)
    for power in (3, 6):
        angle, rate = (getattr(wave(power), what)(drivers) for what in ("angle", "rate"))
        assert np.gradient(angle, time)[1:-1] == pytest.approx(rate[1:-1], abs=1e-4 * np.abs(rate).max())


def test_terms_that_were_not_bought_are_no_parts() -> None:
    effects = (wave(3), wave(4))
    assert [e.name for e in parts_of(effects, "rail_curvature", frozenset({"rail_wave_4"}))] == ["rail_wave_4"]


def test_names_of_powers() -> None:
    assert [rail_power(k) for k in ("t", "u", "w3", "w7", "width", "effect")] == [1, 2, 3, 7, None, None]
