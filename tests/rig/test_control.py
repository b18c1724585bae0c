"""References, limits, estimators and tracking."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gsense_rig.control.controllers import ControlLimits, make_controller
from gsense_rig.control.estimators import DriveObserver
from gsense_rig.control.limits import MotionLimits, refuse_hold, refuse_sine, refuse_triangle
from gsense_rig.control.model import DriveModel
from gsense_rig.control.references import Creep, MoveTo, Setpoint, Sine, SoftStop
from gsense_rig.control.triangle import Triangle
from gsense_rig.plant import DriveParameters

REFERENCES = [
    Sine(0.15, 8.0, 3),
    Sine(0.15, 0.5, 1),
    Sine(0.05, 3.0, 2),
    MoveTo(-0.1, 0.15),
    Creep(0.1, -0.25),
    SoftStop(Setpoint(0.02, 1.2, 0.0)),
    SoftStop(Setpoint(0.02, -0.08, 0.0)),
    Triangle(0.1, 4.0, 2, centre=0.05),
]


@pytest.mark.parametrize("reference", REFERENCES, ids=repr)
def test_velocity_and_acceleration_are_the_derivatives_of_position(reference):
    h = 1e-5
    for t in np.linspace(0.003, min(reference.duration, 30.0) - 0.003, 97):
        before, here, after = (reference.at(t + k * h) for k in (-1, 0, 1))
        assert here.velocity == pytest.approx((after.position - before.position) / (2 * h), abs=1e-5)
        assert here.acceleration == pytest.approx((after.velocity - before.velocity) / (2 * h), abs=2e-2)


@pytest.mark.parametrize("w", [0.5, 1.0, 2.0, 8.0])
def test_sine_starts_and_ends_at_rest_in_the_centre_and_is_exact_in_between(w):
    sine = Sine(0.15, w, 3)
    for t in (0.0, sine.duration):
        assert sine.at(t) == (0.0, 0.0, 0.0)
    assert sine.steady == pytest.approx(3 * 2 * math.pi / w)
    for t in np.linspace(sine.ramp, sine.ramp + sine.steady, 50):
        assert sine.at(t).position == pytest.approx(0.15 * math.sin(w * t), abs=1e-12)  # eq. 7.1
    path = [sine.at(t) for t in np.linspace(0.0, sine.duration, 2000)]
    assert max(abs(p.velocity) for p in path) <= 0.15 * w * 1.3 or w < 2.0
    assert max(abs(p.position) for p in path) <= 0.15


@pytest.mark.parametrize("phase", np.linspace(0.0, 2.0 * math.pi, 13))
def test_soft_stop_out_of_a_sine_stays_within_its_stroke_and_limits(phase):
    start = Setpoint(0.15 * math.sin(phase), 1.2 * math.cos(phase), -9.6 * math.sin(phase))
    stop = SoftStop(start)
    path = [stop.at(t) for t in np.linspace(0.0, stop.duration, 200)]
    assert path[-1].velocity == pytest.approx(0.0, abs=1e-9)
    assert max(abs(p.position) for p in path) < 0.15 + 0.015
    assert max(abs(p.acceleration) for p in path) <= stop.max_deceleration + 1e-9


@pytest.mark.parametrize(
    ("amplitude", "w", "cycles", "word"),
    [
        (0.15, 8.0, 3, None),
        (0.22, 2.0, 1, None),
        (0.23, 1.0, 1, "soft limits"),
        (0.15, 9.5, 1, "velocity"),
        (0.05, 17.0, 1, "acceleration"),
        (0.15, 8.0, 0, "cycles"),
        (-0.1, 1.0, 1, "amplitude"),
        (math.nan, 1.0, 1, "amplitude"),
        (0.1, 0.0, 1, "frequency"),
        (0.1, math.inf, 1, "frequency"),
    ],
)
def test_goals_beyond_rail_and_drive_are_refused_with_a_reason(amplitude, w, cycles, word):
    reason = refuse_sine(amplitude, w, cycles, MotionLimits(), DriveModel(DriveParameters()), ControlLimits())
    assert (reason is None) if word is None else (word in reason)


@pytest.mark.parametrize(
    ("position", "amplitude", "w", "duration", "word"),
    [
        (0.05, 0.15, 4.0, 3.0, None),
        (0.1, 0.15, 4.0, 3.0, "soft limits"),
        (0.0, 0.15, 11.0, 3.0, "cannot turn round"),
        (0.0, -0.1, 4.0, 3.0, "amplitude"),
        (0.0, 0.1, math.nan, 3.0, "frequency"),
        (math.nan, 0.1, 4.0, 3.0, "position"),
        (0.0, 0.1, 4.0, -1.0, "duration"),
        (0.0, 0.1, 4.0, math.inf, "duration"),
    ],
)
def test_triangles_and_holds_beyond_the_rail_are_refused_with_a_reason(position, amplitude, w, duration, word):
    limits = MotionLimits()
    model = DriveModel(DriveParameters())
    reason = refuse_triangle(position, amplitude, w, duration, limits, model, ControlLimits())
    assert (reason is None) if word is None else (word in reason)
    if word in ("position", "duration"):
        assert word in refuse_hold(position, duration, limits)


def test_a_weak_supply_refuses_what_a_strong_one_drives():
    model = DriveModel(replace(DriveParameters(), supply_voltage=12.0))
    assert "12" not in (refuse_sine(0.15, 4.0, 1, MotionLimits(), model, ControlLimits(voltage=11.0)) or "")
    assert "11 V" in refuse_sine(0.15, 8.0, 1, MotionLimits(), model, ControlLimits(voltage=11.0))


def test_unknown_controller_is_named():
    with pytest.raises(ValueError, match="'pid' is unknown"):
        make_controller("pid", DriveParameters())


def test_observer_follows_a_carriage_that_is_pushed_by_hand():
    observer = DriveObserver(DriveParameters(), 1 / 600)
    observer.reset(0.0)
    for k in range(600):
        x = math.floor(0.3 * k / 600 * 20_000) / 20_000
        observer.update(x, None)
    assert observer.velocity == pytest.approx(0.3, abs=0.02)
