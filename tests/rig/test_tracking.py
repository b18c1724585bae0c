"""Both controllers and estimators on simulated rails, and the drive identified by a tune move."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gsense_rig import drive_file, tracking
from gsense_rig.assessment import checks, plants
from gsense_rig.assessment.judging import judge_pi, judge_plant, within_targets, worst
from gsense_rig.control.tuning import TuneError, identify
from gsense_rig.loop.messages import DriveMove, DriveSine, Home, Park, Shape, Stop, Tune, UseModel
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.simulated import VirtualClock, make_simulated_loop
from gsense_rig.plant import DriveParameters, PlantParameters
from gsense_rig.safety.modes import Fault, Mode

# Both ends of the speeds on the plants that were the worst of all that `gsense_rig tracking` drives.
SPEEDS = (1.0, 8.0)
HARD = ("supply_voltage -20%", "carriage_mass +20%, coulomb_friction -20%, resistance +20%, motor_constant -20%")


def homed(plant=None, seed=3):
    loop, hardware = make_simulated_loop(LoopParameters(plant=plant or PlantParameters()), seed)
    clock = VirtualClock(loop, hardware)
    assert clock.run_command(Home(1)).success
    return clock


@pytest.fixture(scope="module")
def nominal():
    return judge_plant(plants.NOMINAL, PlantParameters(), 1, SPEEDS)


def test_feed_forward_keeps_the_targets_where_the_pi_is_14_mm_off(nominal):
    pi = judge_pi(1, SPEEDS)
    assert 0.008 < pi[8.0].rms < 0.022
    assert abs(pi[8.0].phase) > 3.0
    for figures in (nominal.untuned, nominal.tuned):
        assert within_targets(figures)
        assert figures[8.0].rms < 0.05 * pi[8.0].rms


@pytest.mark.parametrize("name", HARD)
def test_plants_20_percent_off_stay_within_the_targets_and_tuning_helps(name, nominal):
    judged = judge_plant(name, plants.all_plants(0.2)[name], 5, SPEEDS)
    assert within_targets(judged.untuned)
    assert within_targets(judged.tuned)
    assert judged.tuned[8.0].rms < 0.3 * judged.untuned[8.0].rms
    assert worst([judged.untuned, nominal.untuned])[8.0].rms == judged.untuned[8.0].rms


def test_a_tuned_drive_shakes_the_accelerometer_less_than_its_own_noise_band(nominal):
    """Below 44 Hz: 0.07 m/s^2 at 1 rad/s; the chip's own white noise there is 0.03."""
    assert nominal.tuned[1.0].shake < 0.07
    assert nominal.tuned[8.0].shake < 0.2
    assert nominal.tuned[1.0].shake < 0.6 * nominal.untuned[1.0].shake


def test_observer_knows_velocity_and_acceleration_better_than_the_best_low_passed_derivative(nominal):
    for w in SPEEDS:
        ours, theirs = nominal.observer[w], nominal.thesis[w]
        assert ours.velocity < 0.003
        assert ours.velocity < 0.2 * theirs.velocity
        assert ours.acceleration < theirs.acceleration
        assert abs(ours.velocity_lag) < 0.5


def test_the_rail_is_the_one_that_was_calculated(nominal):
    for check in checks.checks(nominal.peaks):
        assert check.holds, check


def test_plants_are_all_corners_and_each_number_alone():
    every = plants.all_plants(0.2)
    assert len(every) == 1 + 2 ** len(plants.CORNER_GROUPS) + 2 * len(plants.ALONE)
    assert len({plant.drive for plant in every.values()}) == len(every)


@pytest.mark.parametrize("off", [0.2, -0.2])
def test_tuning_finds_the_numbers_of_a_drive_that_is_off(off):
    true = plants.changed({name: 1.0 + off for group in plants.CORNER_GROUPS for name in group}).drive
    clock = homed(PlantParameters(drive=true))
    record = clock.run_command(Tune(2)).record
    assert record.shape[1] == 3
    found = identify(record, clock.loop.parameters.period, DriveParameters())
    for name, part in (("motor_constant", 0.01), ("resistance", 0.06), ("coulomb_friction", 0.06),
                       ("carriage_mass", 0.1), ("gear_efficiency", 0.05), ("viscous_friction", 0.15)):  # fmt: skip
        assert getattr(found.drive, name) == pytest.approx(getattr(true, name), rel=part), name
    assert found.force_residual < 0.1
    assert "carriage_mass" in found.text(DriveParameters())


def test_tuning_without_a_current_sensor_still_serves_the_feed_forward():
    clock = homed(plants.all_plants(0.2)[HARD[1]])
    record = clock.run_command(Tune(2)).record
    record[:, 2] = math.nan
    found = identify(record, clock.loop.parameters.period, DriveParameters())
    assert found.drive.resistance == DriveParameters().resistance
    assert found.drive.motor_constant == pytest.approx(0.8 * DriveParameters().motor_constant, rel=0.03)
    clock.run_command(UseModel(3, found.drive))
    assert clock.run_command(DriveSine(4, 0.15, 8.0, 2)).rms_error < 0.15e-3


def test_tuning_refuses_what_is_no_drive():
    nominal, period = DriveParameters(), 1.0 / 600.0
    rng = np.random.default_rng(1)
    clock = homed()
    record = clock.run_command(Tune(2)).record
    with pytest.raises(TuneError, match="too few"):
        identify(record[:100], period, nominal)
    with pytest.raises(TuneError, match="hardly moved"):
        identify(np.zeros((6000, 3)), period, nominal)
    with pytest.raises(TuneError, match="check"):
        identify(record * [1.0, 1.0, -1.0], period, nominal)  # current sensor the wrong way round
    with pytest.raises(TuneError, match="wiring"):
        identify(record * [1.0, 1.0, 5.0], period, nominal)
    noisy = record + rng.normal(0.0, [0.0, 0.0, 30.0], record.shape)
    with pytest.raises(TuneError):
        identify(noisy, period, nominal)


def test_an_identified_drive_goes_to_a_file_and_back(tmp_path):
    path, drive = tmp_path / "new" / "drive.yaml", replace(DriveParameters(), carriage_mass=1.75, dead_zone=0.02)
    drive_file.write(path, drive)
    assert drive_file.read(path, DriveParameters()) == drive
    assert [p.name for p in path.parent.iterdir()] == ["drive.yaml"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no drive file"),
        ("schema: other/1\n", "no drive file"),
        ("schema: gsense-drive/1\n", "not a mapping"),
        ("schema: gsense-drive/1\ndrive: {colour: 3}\n", "`colour` is no number of the drive"),
        ("schema: gsense-drive/1\ndrive: {carriage_mass: true}\n", "`carriage_mass` is not a number"),
        ("schema: [\n", "drive.yaml"),
    ],
)
def test_a_drive_file_that_is_none_is_named(tmp_path, text, words):
    path = tmp_path / "drive.yaml"
    path.write_text(text)
    with pytest.raises(TuneError, match=r"drive\.yaml") as caught:
        drive_file.read(path, DriveParameters())
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_moves_end_where_they_should_and_the_motor_is_off():
    clock = homed()
    for command, end in (
        (DriveMove(2, Shape.HOLD, 0.1, duration=0.3), 0.1),
        (DriveMove(3, Shape.STEP, -0.15, duration=0.2), -0.15),
        (DriveMove(4, Shape.TRIANGLE, 0.02, 0.1, 4.0, 2.0), -0.08),
        (Park(5), -0.2),
    ):
        result = clock.run_command(command)
        assert result.success, result.message
        assert result.rms_error < 2e-3
        assert clock.telemetry.position == pytest.approx(end, abs=1e-3)
        assert clock.telemetry.mode == Mode.IDLE
        assert clock.telemetry.disabled


def test_a_triangle_has_constant_speed_between_its_corners_for_as_long_as_asked():
    clock = homed()
    rows = []
    clock.on_tick = lambda t, _history: rows.append((t.time, t.position, t.velocity))
    assert clock.run_command(DriveMove(2, Shape.TRIANGLE, 0.0, 0.15, 4.0, 3.0)).success
    _, position, velocity = np.array(rows).T
    assert position.max() == pytest.approx(0.15, abs=2e-3)
    assert position.min() == pytest.approx(-0.15, abs=2e-3)
    fast = np.abs(velocity) > 0.3
    assert np.std(np.abs(velocity[fast])) < 0.02
    crossings = np.count_nonzero(np.diff(np.sign(position[position != 0.0])))
    assert crossings >= 2 * math.ceil(3.0 * 4.0 / (2.0 * math.pi))


@pytest.mark.parametrize(
    ("command", "word"),
    [
        (DriveMove(2, Shape.STEP, 0.25), "soft limits"),
        (DriveMove(2, 9, 0.0), "shape 9"),
        (DriveMove(2, Shape.TRIANGLE, 0.0, 0.15, 11.0, 1.0), "turn round"),
    ],
)
def test_moves_beyond_the_rail_are_refused(command, word):
    reply = homed().loop.submit(command)
    assert not reply.accepted
    assert word in reply.message


def test_moves_are_refused_unhomed_running_and_in_a_fault():
    loop, hardware = make_simulated_loop(seed=1)
    clock = VirtualClock(loop, hardware)
    commands = (DriveMove(2, Shape.HOLD, 0.0), Park(3), Tune(4))
    assert all("not homed" in loop.submit(c).message for c in commands)
    assert clock.run_command(Home(1)).success
    assert loop.submit(DriveSine(5, 0.1, 2.0, 3)).accepted
    clock.run_for(1.0)
    assert all("busy" in loop.submit(c).message for c in commands)
    assert not loop.submit(UseModel(6, DriveParameters())).accepted
    loop.abort(Fault.COMMAND_LOST, "for the test")
    clock.run_for(1.0)
    assert all("in a fault" in loop.submit(c).message for c in commands)


def test_a_step_is_stopped_softly_and_a_cut_tune_leaves_no_record():
    clock = homed()
    assert clock.loop.submit(Tune(2)).accepted
    clock.run_for(3.0)
    assert clock.run_command(Stop(3)).success
    assert clock.telemetry.mode == Mode.IDLE
    assert clock.loop.submit(DriveMove(4, Shape.STEP, 0.15)).accepted
    clock.run_for(0.25)
    rows = []
    clock.on_tick = lambda t, _history: rows.append(t.velocity)
    assert clock.run_command(Stop(5)).success
    deceleration = np.abs(np.diff(rows)) * clock.loop.parameters.rate
    assert np.percentile(deceleration, 99) < 15.0
    assert clock.hardware.plant.velocity == pytest.approx(0.0, abs=1e-6)


def test_the_command_refuses_nonsense(capsys):
    with pytest.raises(SystemExit) as caught:
        tracking.main(["--off", "90"])
    assert caught.value.code == 2
    assert "not within 0 to 50" in capsys.readouterr().err
