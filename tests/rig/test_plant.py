"""The simulated rail against the figures that were calculated for this drive by other means."""

from dataclasses import replace

import numpy as np
import pytest

from gsense_rig.control.model import DriveModel
from gsense_rig.hardware.interface import MotorOutput
from gsense_rig.hardware.sim import SimRail
from gsense_rig.plant import DriveParameters, PlantParameters, TrackParameters, dynamics
from gsense_rig.plant.plant import Plant

W, A = 8.0, 0.15
LONG_TRACK = TrackParameters(end_stop=50.0)


def drive(mass=1.5, friction=3.0):
    return replace(DriveParameters(), carriage_mass=mass, coulomb_friction=friction, static_friction=max(friction, 3.5))


@pytest.mark.parametrize(
    ("mass", "friction", "voltage", "peak", "rms", "torque"),
    [(1.5, 3.0, 15.1, 2.51, 1.53, 97.8), (2.0, 5.0, 15.5, 3.23, 1.93, 125.8)],
)
def test_sine_asks_the_drive_for_the_calculated_voltage_current_and_torque(mass, friction, voltage, peak, rms, torque):
    model = DriveModel(drive(mass, friction))
    t = np.linspace(0.0, 2.0 * np.pi / W, 2001)
    needs = [model.need(A * W * np.cos(W * k), -A * W * W * np.sin(W * k)) for k in t]
    current = np.array([n.current for n in needs])
    assert max(abs(n.voltage) for n in needs) == pytest.approx(voltage, abs=0.05)
    assert abs(current).max() == pytest.approx(peak, abs=0.01)
    assert np.sqrt(np.mean(current**2)) == pytest.approx(rms, abs=0.01)
    assert abs(current).max() * model.drive.motor_constant * 1e3 == pytest.approx(torque, abs=0.2)


def test_plant_moves_as_the_inverse_model_says():
    """Open loop: the voltage of the inverse model drives the plant along the sine."""
    parameters = PlantParameters(drive=replace(drive(), static_friction=3.0), track=LONG_TRACK)
    model, plant = DriveModel(parameters.drive), Plant(parameters)
    plant.set_motion(0.0, A * W)
    step, rows = 1e-3, []
    for k in range(round(0.18 / step)):  # up to shortly before the first reversal, where dry friction is not linear
        t = (k + 0.5) * step
        u = model.voltage(A * W * np.cos(W * t), -A * W * W * np.sin(W * t))
        rows.append(plant.advance((k + 1) * step, model.duty(u), False))
    history = np.concatenate(rows)
    t = history[:, 0]
    assert history[:, 1] == pytest.approx(A * np.sin(W * t), abs=1.5e-3)
    assert history[20:, 2] == pytest.approx(A * W * np.cos(W * t[20:]), abs=0.02)


def test_the_history_holds_means_over_its_milliseconds():
    """However often the loop looks: a sensor averages over its sample, and kicks are shorter than that."""
    plant = Plant(PlantParameters())
    history = np.concatenate([plant.advance(k / 600, 0.5 * (-1) ** (k // 100), False) for k in range(1, 300)])
    assert history[:, 0] == pytest.approx(np.arange(1, len(history) + 1) * 1e-3)
    assert np.cumsum(history[:, 2]) * 1e-3 == pytest.approx(history[:, 1], abs=1e-9)
    speed = np.cumsum(history[:, 3]) * 1e-3
    assert (speed[1:] + speed[:-1]) / 2 == pytest.approx(history[1:, 2], abs=0.02)
    assert speed[-1] == pytest.approx(history[-1, 2], abs=0.02)
    assert np.ptp(speed) > 0.5


@pytest.mark.parametrize(("mass", "friction"), [(1.5, 3.0), (2.0, 5.0)])
def test_short_circuit_brake_stops_within_18_to_22_mm(mass, friction):
    plant = Plant(PlantParameters(drive=drive(mass, friction), track=LONG_TRACK))
    plant.set_motion(0.0, 1.2)
    history = plant.advance(1.0, 0.0, False)
    assert plant.velocity == 0.0
    assert 0.0175 < plant.position < 0.022
    assert abs(history[:, 4]).max() > 5.0  # the motor's own current brakes


def coasting(mass, force, viscous, v=1.2):
    """Distance of m v' = -F - b v from v to rest [m]."""
    return mass / viscous * (v - force / viscous * np.log(1.0 + viscous * v / force))


def coast(d):
    plant = Plant(PlantParameters(drive=d, track=LONG_TRACK))
    plant.set_motion(0.0, 1.2)
    history = plant.advance(2.0, 0.0, True)
    assert plant.velocity == 0.0
    assert not history[5:, 4].any()  # no current through an open bridge
    return plant.position


@pytest.mark.parametrize(("mass", "distance"), [(1.5, 0.31), (2.0, 0.38)])
def test_coasting_without_rotor_drag_and_gear_loss_is_the_calculated_031_to_038_m(mass, distance):
    d = replace(drive(mass), static_friction=3.0, gear_efficiency=1.0, rotor_viscous=0.0)
    assert coasting(d.load_mass + d.motor_mass, 3.0 + d.motor_coulomb, 2.0) == pytest.approx(distance, abs=2e-3)
    assert coast(d) == pytest.approx(distance, abs=2e-3)


def test_coasting_with_them_is_shorter_by_what_the_closed_form_says():
    """The load alone would slow down faster than the rotor alone: the rotor drives, and the gear takes its share."""
    d = replace(drive(), static_friction=3.0)
    eta = d.gear_efficiency
    distance = coasting(
        d.load_mass + eta * d.motor_mass, 3.0 + eta * d.motor_coulomb, d.viscous_friction + eta * d.motor_viscous
    )
    assert distance == pytest.approx(0.278, abs=1e-3)
    assert coast(d) == pytest.approx(distance, rel=0.01)


def test_belt_stretches_with_the_load_and_rings_at_its_own_frequency():
    d = replace(drive(), coulomb_friction=0.0, static_friction=0.0, viscous_friction=0.0, belt_damping=0.0)
    plant = Plant(PlantParameters(drive=d, track=LONG_TRACK))
    stretch, position = [], []
    for k in range(1, 2001):
        plant.advance(k * 2e-4, 0.6, False)
        stretch.append(plant.encoder_position - plant.position)
        position.append(plant.position)
    acceleration = np.gradient(np.gradient(position, 2e-4), 2e-4)
    force = d.belt_stiffness * np.array(stretch)
    assert force[500:1500] == pytest.approx(d.carriage_mass * acceleration[500:1500], abs=2.0)
    spectrum = abs(np.fft.rfft((force - np.mean(force)) * np.hanning(2000)))
    lighter = 1.0 / (1.0 / d.carriage_mass + 1.0 / (d.pulley_mass + d.gear_efficiency * d.motor_mass))
    own = np.sqrt(d.belt_stiffness / lighter) / (2.0 * np.pi)
    assert np.argmax(spectrum[20:]) + 20 == pytest.approx(own * 0.4, abs=2.0)  # bins of 2.5 Hz


def test_coasting_only_loses_energy():
    plant = Plant(PlantParameters(track=LONG_TRACK))
    plant.set_motion(0.0, 1.2)
    speed = plant.advance(1.0, 0.0, True)[:, 2]
    assert np.all(np.diff(speed) <= 0.0)


def test_energy_from_the_supply_becomes_heat_in_the_winding_motion_and_friction():
    parameters = PlantParameters(track=LONG_TRACK)
    plant, d = Plant(parameters), parameters.drive
    duty, step = 0.2, 1e-3
    history = plant.advance(0.5, duty, False)
    velocity, current = history[:, 2], history[:, 4]
    electrical = DriveModel(d).duty_voltage(duty) * current.sum() * step
    winding = d.resistance * np.sum(current**2) * step
    mechanical = d.force_constant * np.sum(current * velocity) * step
    assert electrical - winding == pytest.approx(mechanical, rel=0.02)
    rotor = 0.5 * d.motor_mass * plant.velocity**2 + d.motor_coulomb * plant.position
    rotor += d.motor_viscous * np.sum(velocity**2) * step
    load = 0.5 * d.load_mass * plant.velocity**2 + d.coulomb_friction * plant.position
    load += d.viscous_friction * np.sum(velocity**2) * step
    assert (mechanical - rotor) * d.gear_efficiency == pytest.approx(load, rel=0.02)


def test_no_load_speed_and_current_limit():
    plant = Plant(PlantParameters(track=LONG_TRACK))
    plant.advance(3.0, 1.0, False)
    d = plant.parameters.drive
    assert plant.velocity < d.supply_voltage / d.force_constant
    assert plant.velocity == pytest.approx(
        (d.supply_voltage - d.resistance * plant.current) / d.force_constant, rel=1e-3
    )
    against_the_stop = Plant(position=0.2995)
    history = against_the_stop.advance(1.0, 1.0, False)
    assert history[100:, 4].max() < d.current_limit + 1.5  # one step of 20 us above at most; a stall would take 20 A
    assert against_the_stop.position <= 0.30


def test_small_duty_and_small_force_do_not_move_it():
    plant = Plant()
    plant.advance(0.5, 0.014, False)  # dead zone
    assert plant.current == 0.0
    plant.advance(1.0, 0.03, False)  # 0.36 V: 3 N, below breakaway
    assert abs(plant.position) < 5e-6  # the belt rings as it tightens
    plant.advance(1.5, 0.08, False)
    assert plant.position > 0.0


def test_buffers_stop_the_carriage_before_the_end_stop():
    plant = Plant()
    plant.set_motion(0.28, 1.0)
    history = plant.advance(1.0, 0.0, True)
    assert 0.29 < history[:, 1].max() < 0.30


def test_history_has_a_row_for_every_millisecond_however_it_is_advanced():
    plant, rng = Plant(), np.random.default_rng(1)
    rows, t = [], 0.0
    while t < 0.5:
        t += rng.uniform(1e-4, 7e-3)
        rows.append(plant.advance(t, 0.2, False))
    times = np.concatenate(rows)[:, 0]
    assert times == pytest.approx(np.arange(1, len(times) + 1) * 1e-3, abs=1e-9)
    whole = Plant().advance(t, 0.2, False)
    assert whole[-1, 1] == pytest.approx(np.concatenate(rows)[-1, 1], rel=2e-2)


def test_switches_have_hysteresis_and_delay():
    plant = Plant(position=-0.239)
    assert plant.switches == (False, False, False, False)
    plant.set_motion(-0.239, -0.5)
    history = plant.advance(0.002, 0.0, True)  # passes -0.24 after about 2 ms
    assert not plant.switches[0]
    plant.advance(0.006, 0.0, True)
    assert plant.switches[0]
    assert history[-1, 1] < -0.2395
    released = Plant(position=-0.2398)
    released.set_motion(-0.2401, 0.0)
    assert released.switches[0]
    released._state[[dynamics.POSITION, dynamics.PULLEY]] = -0.2396  # inside the hysteresis
    released.advance(0.01, 0.0, True)
    assert released.switches[0]
    released._state[[dynamics.POSITION, dynamics.PULLEY]] = -0.2394
    released.advance(0.02, 0.0, True)
    assert not released.switches[0]


def test_sim_rail_counts_50_um_steps_from_a_power_on_zero_and_repeats_by_seed():
    rails = [SimRail(seed=5), SimRail(seed=5), SimRail(seed=6)]
    starts = [rail.plant.position for rail in rails]
    assert starts[0] == starts[1] != starts[2]
    rail = rails[0]
    first = rail.read().counts
    assert first in (0, 1)
    rail.write(MotorOutput(0.3, False, 0))
    for k in range(1, 21):
        rail.advance(k * 0.01)
        moved = (rail.plant.encoder_position - starts[0]) * rail.counts_per_metre
        assert abs(rail.read().counts - first - moved) <= 1.0
    assert moved > 100
