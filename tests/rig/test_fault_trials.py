"""Each fault in mid-run at 8 rad/s, and random commands with any single fault but a broken bridge."""

import math
from dataclasses import replace
from functools import partial

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gsense_rig import faults
from gsense_rig.fault_trials.cases import CASES, set_fault
from gsense_rig.fault_trials.table import END_STOP_FREE, failures, line
from gsense_rig.fault_trials.trial import INSTANTS, Row, run_trial, try_case, worst
from gsense_rig.fault_trials.world import World
from gsense_rig.loop.messages import DriveMove, DriveSine, Home, Park, Reset, Shape, Stop
from gsense_rig.safety.modes import Fault, Light, Mode


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_fault_in_mid_run_is_found_in_time_and_stops_the_carriage(case):
    outcome = run_trial(case, case.phase, INSTANTS[1])
    assert failures(Row(case, outcome, None)) == [], line(Row(case, outcome, None))
    if not case.coasts:
        assert outcome.distance < 0.26
        assert outcome.hit_speed == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_fault_anywhere_in_the_cycle_and_in_the_period(case):
    row = try_case(case, seed=5)
    assert failures(row) == [], line(row)


def test_table_says_so_where_a_bound_is_not_kept():
    case = next(c for c in CASES if c.name == "emergency stop")
    outcome = worst([run_trial(case)])
    late = Row(replace(case, bound=1e-3), replace(outcome, found=2e-3, farthest=0.3, stopped=False), None)
    assert len(failures(late)) == 3
    assert "named" in failures(Row(replace(case, faults=(Fault.STALL,)), outcome, None))[0]


def test_command_prints_the_table_and_knows_its_faults(capsys):
    assert faults.main(["--centre", "--only", "bridge"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[2].startswith("| bridge fault")
    assert lines[-1] == "1 faults: every bound is kept"
    assert faults.main(["--only", "no such"]) == 2


@pytest.mark.parametrize("frequency", [2.0, 8.0, 8.3])
@pytest.mark.parametrize("phase", [0.0, math.pi])
def test_brake_limits_the_motors_current_and_stops_short(frequency, phase):
    world = World(1, position=0.0)
    world.drive(phase, angular_frequency=frequency)
    speed, start = world.rail.plant.velocity, world.rail.plant.position
    world.current = 0.0
    world.loop.abort(Fault.TRACKING, "test of the brake")
    world.run_for(0.5)
    assert world.stopped
    assert world.current < 6.0
    assert abs(world.rail.plant.position - start) < speed**2 / (2 * 28.0) + 0.004


def test_full_short_circuit_would_exceed_that_current():
    world = World(1, position=0.0)
    world.drive(0.0)
    world.loop._drive.brake.parameters = replace(world.loop._drive.brake.parameters, current=100.0)
    world.current = 0.0
    world.loop.abort(Fault.TRACKING, "test of the brake")
    world.run_for(0.3)
    assert world.stopped
    assert world.current > 9.0


def test_fault_is_latched_and_shown_by_the_light_until_reset():
    world = World(1, position=-0.15)
    world.drive(0.0)
    world.rail.injection.emergency_stop = True
    world.run_for(1.0)
    world.rail.injection.emergency_stop = False
    world.run_for(1.0)
    assert (world.telemetry.mode, world.telemetry.light) == (Mode.FAULT, Light.RED)
    assert not world.submit(DriveSine(9, 0.1, 2.0, 1)).accepted
    assert world.submit(Reset(10)).accepted
    world.run_for(0.1)
    assert (world.telemetry.mode, world.telemetry.light) == (Mode.IDLE, Light.GREEN)


# ---- random commands and any single fault

SINGLE_FAULTS = {
    "none": set_fault(),
    "motor cable swapped": set_fault(motor_reversed=True),
    **{f"switch {k} stuck {level}": set_fault(switches={k: level}) for k in range(4) for level in (False, True)},
    **{f"encoder jumps by {n}": set_fault(encoder_jump=n) for n in (-4000, -90, 40, 150, 6000)},
    **{f"current sensor off by {a} A": set_fault(current_offset=a) for a in (-12.0, -5.5, -3.0, 3.0, 5.5)},
    **{
        case.name: case.inject
        for case in CASES
        if not case.coasts and case.name not in ("end switch, driven over", "reference leaves the soft limits")
    },
}

COMMANDS = st.one_of(
    st.just(Home),
    st.just(Stop),
    st.just(Park),
    st.just(Reset),
    st.builds(partial, st.just(DriveSine), amplitude=st.floats(0.005, 0.25), angular_frequency=st.floats(0.3, 20.0),
              cycles=st.integers(1, 4)),
    st.builds(partial, st.just(DriveMove), shape=st.sampled_from(Shape), position=st.floats(-0.24, 0.24),
              amplitude=st.floats(0.0, 0.2), angular_frequency=st.floats(0.3, 12.0), duration=st.floats(0.0, 3.0)),
)  # fmt: skip


def check_never_at_the_ends(start, first, fault, at, commands, seed):
    world = World(seed, position=start)
    world.submit(Home(1))
    world.run_for(first)
    injected = False
    for number, (wait, command) in enumerate(commands, 2):
        if not injected and world.now >= at:
            SINGLE_FAULTS[fault](world)
            injected = True
        world.submit(command(number))
        world.run_for(wait)
    if not injected:
        SINGLE_FAULTS[fault](world)
    world.run_for(1.5)
    assert world.farthest < max(END_STOP_FREE, abs(start) + 1e-6), f"{world.farthest * 1e3:.1f} mm"


RANDOM = given(
    start=st.floats(-0.285, 0.285),
    first=st.sampled_from([0.5, 2.0, 6.0, 6.0, 6.0, 6.0]),
    fault=st.sampled_from(sorted(SINGLE_FAULTS)),
    at=st.floats(0.0, 14.0),
    commands=st.lists(st.tuples(st.floats(0.02, 3.0), COMMANDS), min_size=3, max_size=8),
    seed=st.integers(0, 50),
)
QUIET = {"deadline": None, "suppress_health_check": list(HealthCheck)}


@settings(max_examples=8, derandomize=True, **QUIET)
@RANDOM
def test_carriage_stays_off_the_ends(start, first, fault, at, commands, seed):
    check_never_at_the_ends(start, first, fault, at, commands, seed)


@pytest.mark.slow
@pytest.mark.timeout(900)
@settings(max_examples=150, **QUIET)
@RANDOM
def test_carriage_stays_off_the_ends_many_times(start, first, fault, at, commands, seed):
    check_never_at_the_ends(start, first, fault, at, commands, seed)


@pytest.mark.slow
@pytest.mark.parametrize("fault", sorted(SINGLE_FAULTS))
def test_homing_again_and_again_with_a_fault_stays_off_the_ends(fault):
    for start in (-0.2, 0.0, 0.2):
        world = World(3, position=start)
        SINGLE_FAULTS[fault](world)
        for number in range(1, 13):
            world.submit(Home(number))
            world.run_for(1.5)
            world.submit(Reset(100 + number))
            world.run_for(0.02)
        assert world.farthest < END_STOP_FREE, f"{world.farthest * 1e3:.1f} mm from {start} m"


def test_drive_says_what_it_cannot_drive():
    with pytest.raises(RuntimeError, match="velocity"):
        World(1, position=-0.15).drive(0.0, angular_frequency=9.5)


def test_phases_cover_the_cycle():
    world = World(1, position=-0.15)
    world.drive(0.5 * math.pi)
    assert world.rail.plant.position == pytest.approx(0.15, abs=1e-3)
