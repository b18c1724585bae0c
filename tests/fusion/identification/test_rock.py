"""Play of the bearings (Bouc and Wen's hysteresis, no exponential) at its typical size and far below."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.cases import Case, parameters
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.identification.effects.base import Drivers, Templates
from gsense_fusion.identification.effects.fine import FineGrid
from gsense_fusion.identification.effects.reversal_rock import ReversalRock
from gsense_fusion.identification.effects.reversals import Travel, reversals, to_go, zero_crossings
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.types import Owner

from .sessions import BASE, analysed, finding, names

STICKING = Case("single", ("bearing_play",), 4000.0, 30_402)
AT_200_HZ = replace(BASE, chain=ChainParameters(rate_hz=200.0, filter_hz=42.0))


def test_ripple_about_the_place_where_the_carriage_sticks_is_no_reversal() -> None:
    step, w = 0.005, 1.5
    t = np.arange(0.0, 20.0, step)
    free = 0.15 * np.sin(w * t)
    smooth = np.clip(free, -0.149, 0.149), np.where(np.abs(free) < 0.149, 0.15 * w * np.cos(w * t), 0.0)
    ripple = 5e-5 * np.sin(30 * w * t), 5e-5 * 30 * w * np.cos(30 * w * t)
    position, velocity = smooth[0] + ripple[0], smooth[1] + ripple[1]
    true, places = reversals(*smooth, step)
    found, where = reversals(position, velocity, step)
    assert len(zero_crossings(velocity)) > 2 * len(true)
    assert len(found) == len(true) == len(zero_crossings(smooth[1]))
    assert found * step == pytest.approx(true * step, abs=0.2)
    assert where == pytest.approx(places, abs=1e-4)
    error = Travel.of(t, position, velocity).angle(4e-4) - Travel.of(t, *smooth).angle(4e-4)
    assert np.sqrt(np.mean(error**2)) < 0.1


def test_a_carriage_that_all_but_stands_reverses_within_its_samples() -> None:
    velocity = np.array([0.1, 1e-12, 1.0000001e-12, -1e-13, 2e-10, -0.1])
    crossings = zero_crossings(velocity)
    assert len(crossings) == 1
    assert 4.0 <= crossings[0] <= 5.0


def test_contacts_give_way_between_evenly_and_as_an_exponential() -> None:
    travel = np.linspace(0.0, 4.0, 401)
    assert to_go(travel, 0.0) == pytest.approx(np.maximum(2.0 - travel, 0.0))
    assert to_go(travel, 1.0) == pytest.approx(2.0 * np.exp(-travel))
    between = to_go(travel, 0.5)
    assert np.gradient(between, travel)[50] == pytest.approx(-np.sqrt(between[50]), rel=1e-3)
    assert to_go(travel, 0.999) == pytest.approx(to_go(travel, 1.0), abs=2e-3)


def test_behind_a_belt_that_gives_way_the_turn_begins_late() -> None:
    step, w, lost, width = 1e-3, 2.0, 6e-5, 2e-4
    t = np.arange(0.0, 12.0, step)
    pulley, speed = 0.15 * np.sin(w * t), 0.15 * w * np.cos(w * t)
    carriage, turn = np.zeros(len(t)), np.zeros(len(t))
    for k in range(1, len(t)):  # backlash drags the carriage, and the carriage the turn
        carriage[k] = np.clip(carriage[k - 1], pulley[k] - lost / 2, pulley[k] + lost / 2)
        turn[k] = np.clip(turn[k - 1] + (carriage[k] - carriage[k - 1]) / width, -1.0, 1.0)
    middle = width + lost
    angle = Travel.of(t, pulley, speed).angle(middle, 0.0, lost / middle)
    late = t > 2.0
    assert np.abs((angle[1:] + angle[:-1])[late] / 2 - turn[late]).max() < 0.05
    without = Travel.of(t, pulley, speed).angle(middle, 0.0)
    assert np.abs((without[1:] + without[:-1])[late] / 2 - turn[late]).max() > 0.2


def test_lag_of_the_contacts_keeps_the_turn_and_delays_it() -> None:
    step, lag = 1e-3, 0.02
    t = np.arange(2000) * step
    pulse = np.exp(-(((t - 0.5) / 0.05) ** 2))
    grid = FineGrid(1, step)
    spectrum = grid.spectrum(pulse)
    late = grid.of_spectrum(spectrum * grid.late(spectrum, lag_s=lag), len(t))
    assert late.sum() == pytest.approx(pulse.sum(), rel=1e-4)
    assert np.sum(t * late) / late.sum() == pytest.approx(0.5 + lag, abs=1e-4)


@pytest.mark.parametrize("delay", [0.0037, -0.012, 0.061])
def test_a_late_gyro_has_the_turn_of_the_motion_on_time_later(delay: float) -> None:
    """One turn for all delays and lags that are tried, where each was made from a motion of its own."""
    t, w = np.arange(0.0, 20.0, 0.005), 3.0

    def motion(at: np.ndarray) -> Kinematics:
        s, c = 0.15 * np.sin(w * at), 0.15 * np.cos(w * at)
        return Kinematics(s, w * c, -(w**2) * s, -(w**3) * c)

    templates = Templates().set("gyro_delay_s", delay).set("rock_width_m", 1e-3).set("rock_lag_s", 0.004)
    made = Drivers(motion(t - delay), None, None, None, t, templates=templates)
    late = replace(made, on_time=motion(t))
    inside = slice(200, -200)
    expected, found = ReversalRock().rate(made)[inside], ReversalRock().rate(late)[inside]
    assert np.std(found - expected) < 0.01 * np.std(expected)


@pytest.mark.slow
def test_play_holds_where_slow_runs_stick_at_their_reversals() -> None:
    result = analysed(Disturbance("bearing_play", 3.144e-5), base=parameters(STICKING))
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == ["reversal_rock"]
    r = finding(result, "reversal_rock").parameters
    assert np.linalg.norm([r[f"r_{x}"].value for x in "xyz"]) == pytest.approx(3.144e-5, rel=0.1)


@pytest.mark.slow
def test_play_of_a_typical_size_is_found_with_its_turn() -> None:
    play = Disturbance("bearing_play", 0.01 * DEG)
    result = analysed(play, base=AT_200_HZ)
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == ["reversal_rock"]
    found = finding(result, "reversal_rock")
    assert found.owner is Owner.RIG
    turn = np.array([found.parameters[f"r_{x}"].value for x in "xyz"])
    assert np.linalg.norm(turn) == pytest.approx(play.size, rel=0.15)
    assert 2e-4 < found.parameters["width"].value < 8e-4


@pytest.mark.slow
def test_play_below_what_a_session_can_show_is_not_claimed() -> None:
    result = analysed(Disturbance("bearing_play", 0.00003 * DEG), base=AT_200_HZ)
    assert result.verdict == "nothing_missing", (names(result), result.unexplained)
