"""The watcher on the independent simulator's streams. `./rig bench watch` does it for hours."""

from __future__ import annotations

import numpy as np
import pytest
from tests.fusion.watch.live import Shift, first_alarm, watch
from tests.study.simulator.parameters import Disturbance

from gsense_fusion.compensation import ReferenceTerm
from gsense_fusion.identification.effects import REGRESSED
from gsense_fusion.identification.effects.base import Drivers
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.motion.mounting import Mounting
from gsense_fusion.watch import Watcher
from gsense_fusion.watch.reference import true_rate


@pytest.mark.slow
def test_nothing_is_said_where_nothing_is_missing() -> None:
    reports = list(watch(Shift(5, frequencies=(7.0,))))
    assert {report.state for report in reports} == {"rest", "steady", "other"}
    assert first_alarm(reports) is None


@pytest.mark.slow
def test_what_enters_in_mid_run_is_named_within_a_minute() -> None:
    shift = Shift(6, Disturbance("rectification", 4e-5), onset_s=80.0, frequencies=(7.0,), duration_s=90.0)
    reports = list(watch(shift))
    report = first_alarm(reports)
    assert report is not None
    assert 80.0 < report.time < 140.0
    (alarm,) = report.fresh
    assert alarm.kind == "orders"
    assert alarm.suspects[0] == "g_squared"
    assert 80.0 < alarm.since <= alarm.raised == report.time
    assert "order 2" in alarm.text


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "size", "name"), [("motion_tone", 4e-4, "line_tone"), ("speed_noise", 3e-4, "speed_noise")]
)
def test_tones_and_noise_of_the_motion_are_named(kind: str, size: float, name: str) -> None:
    report = first_alarm(list(watch(Shift(7, Disturbance(kind, size), 80.0, (6.0,), 90.0))))
    assert report is not None
    assert 80.0 < report.time < 140.0
    assert report.fresh[0].suspects[0] == name


@pytest.mark.parametrize("begins", [True, False])
def test_what_was_measured_before_the_bias_was_known_is_forgotten(begins: bool) -> None:
    """Else the first mean holds the whole bias, and steps drown in what it makes of the scale."""
    watcher = Watcher()
    rng = np.random.default_rng(1)
    alarms = []
    for i in range(120 * 50):
        t = i / 50.0
        if begins and i == 50:
            watcher.begin_anew(t)
        residual = 1e-4 * rng.standard_normal(3) + (0.05 if t < 1.0 else 0.0) + (5e-4 if t > 60.0 else 0.0)
        watcher.add_position(t, 0.0)
        watcher.add_sample(t, residual, np.array([0.0, 0.0, 9.81]))
        if watcher.due():
            alarms += [a.suspects for a in watcher.test(watcher.window()).fresh]
    assert alarms == ([("bias_jump",)] if begins else [])


@pytest.mark.parametrize("set_by", [3600.0, -3600.0, -40.0])
@pytest.mark.parametrize("follows", [0.6, -0.6])
def test_a_clock_that_is_set_raises_no_alarm_and_blinds_for_half_a_minute_at_most(
    set_by: float, follows: float
) -> None:
    """The rig's stamps follow the clock `follows` seconds after the sensor's."""
    watcher = Watcher()
    rng = np.random.default_rng(1)
    seen = []
    for i in range(150 * 50):
        t = i / 50.0
        stamp = t + (set_by if t >= 60.0 else 0.0)
        encoder = t + (set_by if t >= 60.0 + follows else 0.0)
        watcher.add_position(encoder, 0.0)
        jump = 2e-3 if t > 120.0 else 0.0
        watcher.add_sample(stamp, 1e-4 * rng.standard_normal(3) + jump, np.array([0.0, 0.0, 9.81]))
        if watcher.due():
            report = watcher.test(watcher.window())
            seen.append((t, report.state, [a.kind for a in report.fresh]))
    assert {state for t, state, _ in seen if t < 60.0 or t > 70.0} - {"other"} == {"rest"}
    assert all(state == "rest" for t, state, _ in seen if t > 70.0)
    raised = [t for t, _, fresh in seen if fresh]
    assert len(raised) == 1
    assert 120.0 < raised[0] < 150.0  # what is really there is still said


def test_a_true_rotation_that_the_file_knows_belongs_to_the_prediction() -> None:
    velocity = np.array([0.3, -0.2])
    motion = Kinematics(np.array([0.1, 0.0]), velocity, np.zeros(2), np.zeros(2))
    turned = Mounting(np.array([0.0, 0.0, 1.0]), np.array([-1.0, 0.0, 0.0]))
    drivers = Drivers(motion, turned, None, None, np.array([0.0, 1.0]))
    term = ReferenceTerm("rail_curvature", {"t": (0.0, 2e-3, 0.0), "u": (0.0, 0.0, 0.0)})
    rate = true_rate([term], drivers, REGRESSED)
    assert rate[:, 1] == pytest.approx(-2e-3 * velocity)  # the board is turned: so is the axis
    assert rate[:, [0, 2]] == pytest.approx(0.0)


def test_a_true_rotation_is_as_late_as_the_file_says() -> None:
    """What shapes the tilt stands in the file beside it: below the bearings' mode the turn is late by the lag."""
    time = np.arange(0.0, 20.0, 0.005)
    w, lag = 8.0, 0.01
    motion = Kinematics(
        *(w**k * np.sin(w * time + k * np.pi / 2) for k in range(4))  # position, velocity, acceleration, jerk
    )
    level = Mounting(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
    drivers = Drivers(motion, level, None, None, time)
    term = ReferenceTerm("belt_tilt", {"c": (0.0, 1e-5, 0.0), "mode": 150.0, "lag": lag})
    middle = slice(1000, 3000)
    expected = 1e-5 * w**3 * np.sin(w * (time - lag) + 3 * np.pi / 2)
    assert true_rate([term], drivers, REGRESSED)[middle, 1] == pytest.approx(expected[middle], abs=0.01 * 1e-5 * w**3)
