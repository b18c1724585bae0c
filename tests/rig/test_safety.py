"""Homing, the state machine, and each fault, injected into a carriage in motion on a virtual clock."""

import numpy as np
import pytest

from gsense_rig.hardware.interface import HardwareError
from gsense_rig.loop.messages import DriveSine, Home, Reset, Stop
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.simulated import VirtualClock, make_simulated_loop
from gsense_rig.safety.modes import Fault, Light, Mode
from gsense_rig.safety.monitor import SafetyLimits


def started(seed=1, position=None, **parameters):
    loop, hardware = make_simulated_loop(LoopParameters(**parameters), seed, position)
    return VirtualClock(loop, hardware)


def homed(**kwargs):
    clock = started(position=-0.15, **kwargs)
    assert clock.run_command(Home(1)).success
    return clock


def at_full_speed(w=8.0):
    """Homed and crossing the centre at full speed in mid-run."""
    clock = homed()
    assert clock.loop.submit(DriveSine(2, 0.15, w, 5)).accepted
    clock.run_for(2.6)
    for t, _ in clock.steps():
        if abs(t.position) < 0.005 and abs(t.velocity) > 0.14 * w:
            return clock
    raise AssertionError


@pytest.mark.parametrize("seed", range(8))
def test_homing_finds_the_middle_from_anywhere(seed):
    start = float(np.random.default_rng(seed).uniform(-0.28, 0.28))
    clock = started(seed, start)
    result = clock.run_command(Home(1))
    assert result.success, result.message
    t = clock.telemetry
    assert t.homed
    assert t.mode == Mode.IDLE
    assert t.light == Light.GREEN
    assert t.disabled
    assert t.position == pytest.approx(clock.hardware.plant.position, abs=0.3e-3)
    assert abs(t.position) < 1e-3


@pytest.mark.parametrize("start", [-0.289, -0.2405, 0.0, 0.2405, 0.289])
def test_homing_starts_on_a_switch_or_the_buffer(start):
    clock = started(2, start)
    assert clock.run_command(Home(1)).success
    assert abs(clock.hardware.plant.position) < 1e-3


@pytest.mark.parametrize(
    ("levels", "fault", "word"),
    [
        ({0: True}, Fault.SWITCH_STUCK, "left switch stays pressed"),
        ({0: False}, Fault.HOMING_FAILED, "no left switch"),
        ({2: False}, Fault.HOMING_FAILED, "no right switch"),
        ({2: True}, Fault.SWITCH_STUCK, "right switch stays pressed"),
    ],
)
def test_homing_with_a_broken_switch_fails_with_the_reason(levels, fault, word):
    clock = started(1, -0.1)
    clock.hardware.injection.switches = levels
    clock.step()
    result = clock.run_command(Home(1))
    assert not result.success
    assert word in result.message
    clock.run_for(1.5)
    t = clock.telemetry
    assert (t.mode, t.fault, t.light, t.disabled) == (Mode.FAULT, fault, Light.RED, True)
    assert clock.loop.submit(Reset(2)).accepted
    clock.step()
    assert clock.telemetry.mode == Mode.UNHOMED


def test_homing_with_a_reversed_motor_fails():
    clock = started(1, 0.1)
    clock.hardware.injection.motor_reversed = True
    assert not clock.run_command(Home(1)).success
    assert clock.telemetry.mode == Mode.FAULT
    clock.run_for(1.0)
    assert abs(clock.hardware.plant.position) < 0.29


def test_sine_is_refused_unhomed_running_and_in_a_fault():
    clock = started(1, 0.05)
    sine = DriveSine(5, 0.1, 2.0, 1)
    assert "not homed" in clock.loop.submit(sine).message
    assert clock.run_command(Home(1)).success
    assert "soft limits" in clock.loop.submit(DriveSine(6, 0.25, 1.0, 1)).message
    assert clock.loop.submit(sine).accepted
    assert clock.telemetry.mode == Mode.IDLE
    clock.step()
    assert (clock.telemetry.mode, clock.telemetry.light) == (Mode.RUNNING, Light.AMBER)
    assert "busy" in clock.loop.submit(DriveSine(7, 0.1, 2.0, 1)).message
    assert "busy" in clock.loop.submit(Home(8)).message
    clock.hardware.injection.emergency_stop = True
    clock.step()
    assert "reset" in clock.loop.submit(sine).message


def test_sine_ends_at_rest_in_the_centre_with_the_motor_off():
    clock = homed()
    result = clock.run_command(DriveSine(2, 0.15, 8.0, 2))
    assert result.success
    assert result.rms_error < 0.5e-3
    assert clock.telemetry.mode == Mode.IDLE
    assert clock.telemetry.disabled
    assert abs(clock.hardware.plant.position) < 0.5e-3
    assert clock.run_command(DriveSine(3, 0.15, 4.0, 1)).success  # and again


def test_stop_in_mid_run_is_soft_and_ends_idle():
    clock = at_full_speed()
    peak = []
    clock.on_tick = lambda _t, h: peak.extend(np.abs(h[:, 3]))
    result = clock.run_command(Stop(9))
    assert result.success
    assert clock.telemetry.mode == Mode.IDLE
    assert clock.telemetry.disabled
    assert clock.hardware.plant.velocity == 0.0
    assert max(peak) < 20.0  # a short-circuit brake would make some 80 m/s²
    assert clock.run_command(DriveSine(10, 0.1, 2.0, 1)).success  # from where it stopped


def test_stop_while_homing_leaves_it_unhomed():
    clock = started(1, 0.2)
    clock.loop.submit(Home(1))
    clock.run_for(0.3)
    assert clock.run_command(Stop(2)).success
    assert clock.telemetry.mode == Mode.UNHOMED
    assert clock.telemetry.disabled


def test_stop_on_the_switch_while_homing_is_no_fault():
    clock = homed()
    clock.loop.submit(Home(2))
    while not clock.telemetry.switches[0]:
        clock.step()
    assert clock.run_command(Stop(3)).success
    assert (clock.telemetry.mode, clock.telemetry.fault) == (Mode.UNHOMED, Fault.NONE)


def test_encoder_that_jumps_while_idle_is_a_fault():
    clock = homed()
    inject_jump(clock)
    clock.step()
    assert clock.telemetry.fault == Fault.ENCODER


def inject_jump(clock):
    clock.hardware.injection.encoder_jump = 4000


def test_stall_is_found_and_reversals_are_not_taken_for_one():
    clock = homed()
    clock.hardware.injection.jammed = True
    result = clock.run_command(DriveSine(2, 0.15, 2.0, 1), timeout=5.0)
    assert clock.telemetry.fault == Fault.STALL, clock.telemetry.fault_text
    assert "stands" in result.message
    slow = homed()
    assert slow.run_command(DriveSine(2, 0.01, 0.5, 1)).success


def test_carriage_that_jams_at_speed_is_a_fault():
    clock = at_full_speed()
    clock.hardware.injection.jammed = True
    clock.run_for(0.1)
    assert clock.telemetry.fault in (Fault.STALL, Fault.TRACKING, Fault.OVERCURRENT)


def test_silence_of_the_loop_and_of_the_command_source():
    clock = at_full_speed()
    clock.hardware.advance(clock.now + 0.05)
    clock.loop.sign_of_life(clock.now + 0.05)
    assert clock.loop.tick(clock.now + 0.05).fault == Fault.DEADLINE
    loop, hardware = make_simulated_loop(LoopParameters(safety=SafetyLimits(command_timeout=0.1)), 1, 0.2)
    loop.tick(0.0)
    loop.submit(Home(1))
    k = 0
    while loop.machine.mode is not Mode.FAULT:
        k += 1
        hardware.advance(k / 600)
        loop.tick(k / 600)
        assert k < 70
    assert loop.machine.fault is Fault.COMMAND_LOST


def test_a_fault_is_latched_until_reset_and_keeps_the_zero_only_where_it_is_still_known():
    clock = at_full_speed()
    clock.hardware.injection.emergency_stop = True
    clock.run_for(2.0)
    clock.hardware.injection.emergency_stop = False
    clock.run_for(0.1)
    assert clock.telemetry.mode == Mode.FAULT
    assert clock.telemetry.fault_text == "emergency stop pressed"
    assert clock.run_command(Reset(3)).success
    clock.step()
    assert clock.telemetry.mode == Mode.IDLE
    assert clock.telemetry.fault == Fault.NONE
    assert not clock.loop.submit(Reset(4)).accepted
    clock = at_full_speed()
    clock.hardware.injection.encoder_frozen = True
    clock.run_for(2.0)
    assert clock.run_command(Reset(3)).success
    clock.step()
    assert clock.telemetry.mode == Mode.UNHOMED


def test_hardware_that_stops_answering_is_a_fault():
    clock = at_full_speed()

    def silent():
        raise HardwareError("card does not answer")

    clock.hardware.read = silent
    clock.step()
    assert clock.telemetry.fault == Fault.HARDWARE
    clock.run_for(0.5)
    assert clock.telemetry.disabled
    assert clock.hardware.plant.velocity == 0.0
    assert abs(clock.hardware.plant.position) < 0.04


def test_numbers_are_those_of_the_message():
    state = pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace (./rig test)").RigState
    for kind in (Mode, Light, Fault):
        for item in kind:
            assert getattr(state, item.name) == int(item)
