"""References, limits, estimators and tracking."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gsense_rig.control.controllers import ControlLimits, make_controller
from gsense_rig.control.estimators import DerivativeEstimator, DriveObserver
from gsense_rig.control.limits import MotionLimits, refuse_sine
from gsense_rig.control.model import DriveModel
from gsense_rig.control.references import Creep, MoveTo, Setpoint, Sine, SoftStop
from gsense_rig.loop.messages import DriveSine, Home
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.simulated import VirtualClock, make_simulated_loop
from gsense_rig.plant import DriveParameters, PlantParameters

REFERENCES = [
    Sine(0.15, 8.0, 3),
    Sine(0.15, 0.5, 1),
    Sine(0.05, 3.0, 2),
    MoveTo(-0.1, 0.15),
    Creep(0.1, -0.25),
    SoftStop(Setpoint(0.02, 1.2, 0.0)),
    SoftStop(Setpoint(0.02, -0.08, 0.0)),
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


def test_a_weak_supply_refuses_what_a_strong_one_drives():
    model = DriveModel(replace(DriveParameters(), supply_voltage=12.0))
    assert "12" not in (refuse_sine(0.15, 4.0, 1, MotionLimits(), model, ControlLimits(voltage=11.0)) or "")
    assert "11 V" in refuse_sine(0.15, 8.0, 1, MotionLimits(), model, ControlLimits(voltage=11.0))


def test_unknown_controller_is_named():
    with pytest.raises(ValueError, match="'pid' is unknown"):
        make_controller("pid", DriveParameters())


def drive_sine(w, controller="feedforward", plant=None, cycles=1):
    """Tracking RMS [m], phase error [deg], velocity errors of the two estimators [m/s] over the steady part."""
    parameters = LoopParameters(controller=controller, plant=plant or PlantParameters())
    loop, hardware = make_simulated_loop(parameters, seed=3, position=-0.2)
    clock = VirtualClock(loop, hardware)
    clock.run_command(Home(1))
    simple = DerivativeEstimator(parameters.period)
    rows = []

    def note(t, _history):
        simple.update(t.position)
        rows.append((t.time, t.position, t.reference, t.velocity, simple.velocity, hardware.plant.velocity))

    clock.on_tick = note
    result = clock.run_command(DriveSine(2, 0.15, w, cycles))
    assert result.success, result.message
    t, position, reference, observer, derivative, truth = np.array(rows).T
    sine = Sine(0.15, w, cycles)
    end = t[-1] - parameters.settle - sine.ramp
    steady = (t > end - sine.steady) & (t < end)
    phasor = np.exp(-1j * w * t[steady])
    phase = np.angle(np.sum(position[steady] * phasor) / np.sum(reference[steady] * phasor), deg=True)
    errors = [float(np.std((v - truth)[steady])) for v in (observer, derivative)]
    return result.rms_error, phase, *errors


def other_plant(mass_factor, motor_factor):
    d = DriveParameters()
    return PlantParameters(
        drive=replace(
            d,
            carriage_mass=d.carriage_mass * mass_factor,
            coulomb_friction=d.coulomb_friction * mass_factor,
            static_friction=d.static_friction * mass_factor,
            viscous_friction=d.viscous_friction * mass_factor,
            resistance=d.resistance * mass_factor,
            motor_constant=d.motor_constant * motor_factor,
        )
    )


def test_tracking_table_of_both_controllers(capsys):
    lines = [
        "  w      pi rms   phase   | feed-forward rms   phase   | +20 % plant rms   phase  | -20 % plant rms   phase"
    ]
    for w in (0.5, 3.0, 8.0):
        pi_rms, pi_phase, *_ = drive_sine(w, "pi")
        rows = [drive_sine(w, plant=p)[:2] for p in (None, other_plant(1.2, 0.8), other_plant(0.8, 1.2))]
        text = " | ".join(f"{rms * 1e3:9.3f} mm {phase:8.4f} deg" for rms, phase in [(pi_rms, pi_phase), *rows])
        lines.append(f"{w:4.1f} {text}")
        for rms, phase in rows:
            assert rms < 0.5e-3
            assert abs(phase) < 0.2
        assert rows[0][0] < 0.2 * pi_rms
    with capsys.disabled():
        print("\n" + "\n".join(lines))
    assert 0.008 < pi_rms < 0.022  # a plain PI is some 14 mm off at 8 rad/s


def test_observer_knows_the_velocity_better_than_the_low_passed_derivative():
    _, _, observer, derivative = drive_sine(8.0)
    assert observer < 0.005
    assert observer < 0.5 * derivative


def test_observer_follows_a_carriage_that_is_pushed_by_hand():
    observer = DriveObserver(DriveParameters(), 1 / 600)
    observer.reset(0.0)
    for k in range(600):
        x = math.floor(0.3 * k / 600 * 20_000) / 20_000
        observer.update(x, None)
    assert observer.velocity == pytest.approx(0.3, abs=0.02)
