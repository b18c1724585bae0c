"""The MF624's driver on an emulated register file, and the whole loop on it with a simulated rail on its terminals."""

import os
import signal
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.rig.emulated_card import LivePlace, emulated_rail, make_tree, page_of
from tests.rig.processes import alive, children, wait_for

from gsense_rig.hardware.interface import HardwareError, MotorOutput
from gsense_rig.hardware.mf624 import CardRailSpec, Wiring, find_card, load_wiring
from gsense_rig.hardware.mf624.card import PWM_STEPS
from gsense_rig.loop.client import LoopProcess
from gsense_rig.loop.messages import DriveSine, Home
from gsense_rig.loop.parameters import LoopParameters
from gsense_rig.loop.rig_loop import RigLoop
from gsense_rig.loop.simulated import VirtualClock
from gsense_rig.loop.spec import ProcessSpec
from gsense_rig.plant import PlantParameters
from gsense_rig.safety.guard import Guard, GuardLimits
from gsense_rig.safety.modes import Fault, Mode
from gsense_rig.safety.monitor import SafetyLimits

OFF = MotorOutput(0.0, True, 0)


def test_missing_card_is_one_clear_line(tmp_path):
    place = make_tree(tmp_path, name="other")
    with pytest.raises(HardwareError, match=r"no MF624 card.*hardware:=sim") as caught:
        CardRailSpec(place).open()
    assert "\n" not in str(caught.value)
    assert find_card(tmp_path / "nowhere") is None
    (place.uio_class / "uio0/name").write_text("mf624\n")
    assert find_card(place.uio_class) == place.uio_class / "uio0"


def test_card_that_cannot_be_opened_or_mapped_is_one_clear_line(tmp_path):
    place = make_tree(tmp_path)
    (tmp_path / "dev/uio0").unlink()
    with pytest.raises(HardwareError, match=r"cannot open .*uio0: No such file"):
        place.open()
    (tmp_path / "dev/uio0").write_bytes(bytes(10))
    with pytest.raises(HardwareError, match="cannot map the MF624's registers"):
        place.open()
    (tmp_path / "dev/uio0").chmod(0)
    if os.geteuid() != 0:
        with pytest.raises(HardwareError, match="udev"):
            place.open()


def test_one_loop_drives_a_card_and_its_guard_beside_it(tmp_path, monkeypatch):
    monkeypatch.setattr("gsense_rig.exclusive.PATIENCE", 0.1)
    place = make_tree(tmp_path)
    windows = place.open(exclusive=True)
    with pytest.raises(HardwareError, match="driven by another rig node"):
        place.open(exclusive=True)
    for window in (*place.open(), *windows):  # the guard's handle is no second loop
        window.close()
    place.open(exclusive=True)


@pytest.mark.parametrize("raw_addresses", [False, True])
def test_registers_lie_at_their_offsets_in_the_mapped_pages(tmp_path, raw_addresses):
    windows = make_tree(tmp_path, raw_addresses=raw_addresses).open()
    windows.badr0.write32(0x54, 0x024006C0)
    windows.badr1.write16(0x10, 0x5A)  # one byte that is not zero
    windows.badr2.write32(0x70, 0x80000001)
    content = (tmp_path / "dev/uio0").read_bytes()
    page = len(content) // 3
    assert content[0x54:0x58] == bytes.fromhex("c0064002")
    assert content[page + 0x110 : page + 0x112] == b"\x5a\x00"
    assert content[2 * page + 0xF0 : 2 * page + 0xF4] == bytes.fromhex("01000080")
    assert sum(map(bool, content)) == 7  # nothing else was touched
    assert windows.badr2.read32(0x70) == 0x80000001


def test_start_is_safe_and_in_order(tmp_path):
    card, spec = emulated_rail(tmp_path)
    assert card.counters[0].output() == (0.5, pytest.approx(250e3))  # what a dead process may have left
    spec.open()
    assert card.violations == []
    assert card.writes[0] == (1, 0x10, 1 << card.wiring.disable)
    assert [c.output()[0] for c in card.counters] == [0.0] * 5
    assert card.dac == dict.fromkeys(range(8), 0x2000)
    assert card.gpioc == 0x024006C0 & ~(1 << 23) | 1 << 26
    order = [(region, offset) for region, offset, _ in card.writes]
    assert order.index((1, 0x20)) < order.index((0, 0x54))  # D/A at 0 V before they are enabled
    assert page_of(tmp_path, 1).read16(0x20) == 0x2000  # in the file behind it too


@pytest.mark.parametrize("share", [1 / PWM_STEPS, 0.1, 0.25, 0.5, 0.9, 1 - 1 / PWM_STEPS])
def test_pwm_is_24_khz_with_the_share_asked_for(tmp_path, share):
    card, spec = emulated_rail(tmp_path)
    rail = spec.open()
    for duty in (share, -share):
        rail.write(MotorOutput(duty, False, 1))
        level, frequency = card.counters[0].output()
        assert level == pytest.approx(share, abs=0.5 / PWM_STEPS)
        assert frequency == pytest.approx(24e3, abs=10.0)
        assert card.rail.output.duty == pytest.approx(duty, abs=0.5 / PWM_STEPS)
        assert card.rail.output.light == 1
    assert card.violations == []


def test_running_pwm_takes_a_new_share_without_being_stopped(tmp_path):
    card, spec = emulated_rail(tmp_path)
    rail = spec.open()
    rail.write(MotorOutput(0.3, False, 1))
    before = len(card.writes)
    rail.write(MotorOutput(0.4, False, 1))
    assert [(region, offset) for region, offset, _ in card.writes[before:]] == [(1, 0x10), (2, 0x04), (2, 0x08)]
    assert card.counters[0].output()[0] == pytest.approx(0.4, abs=1e-3)


def test_random_outputs_never_turn_the_bridge_under_power(tmp_path):
    card, spec = emulated_rail(tmp_path)
    rail = spec.open()
    rng = np.random.default_rng(1)
    for _ in range(2000):
        duty = float(rng.choice([0.0, 1.0, -1.0, rng.uniform(-1, 1)]))
        disabled = bool(rng.random() < 0.2)
        rail.write(MotorOutput(0.0 if disabled else duty, disabled, int(rng.integers(4))))
        assert card.rail.output.disabled == disabled
        if not disabled:
            assert card.rail.output.duty == pytest.approx(duty, abs=1 / PWM_STEPS)
    rail.write(OFF)
    assert card.counters[0].output()[0] == 0.0
    assert card.violations == []


@pytest.mark.parametrize("first", [0x7FFFFFF0, 0xFFFFFFF0, 5])
def test_encoder_counts_on_through_every_wrap(tmp_path, first):
    card, spec = emulated_rail(tmp_path, position=0.0, first_count=first)
    rail = spec.open()
    start = rail.read().counts
    for x in (0.001, 0.1, -0.1, -0.0005):
        card.plant.set_motion(x, 0.0)
        assert rail.read().counts - start == pytest.approx(x * 20_000, abs=1.1)


def test_inputs_current_and_their_senses(tmp_path):
    card, spec = emulated_rail(tmp_path, position=-0.25)
    rail = spec.open()
    fault = card.rail.injection
    assert rail.read().switches == (True, False, False, False)
    assert rail.read().bridge_ok
    assert not rail.read().emergency_stop
    fault.bridge_failed = fault.emergency_stop = True
    assert not rail.read().bridge_ok
    assert rail.read().emergency_stop
    card.rail.current_noise = 0.0
    card.rail._noise = []
    for amperes in (3.0, -7.5, 19.9, -20.0):
        fault.current_offset = amperes
        assert rail.read().current == pytest.approx(amperes, abs=2.5e-3)  # a step of 1.22 mV is 2.44 mA
    fault.current_offset = 1.0
    card.plant.set_motion(0.2, 0.0)
    assert rail.read().switches == (False, False, False, True)


def test_a_card_that_is_gone_or_stuck_is_a_hardware_error(tmp_path):
    card, spec = emulated_rail(tmp_path)
    rail = spec.open()
    card.adc_stuck = True
    with pytest.raises(HardwareError, match="conversion does not end"):
        rail.read()
    card.gone = True
    for call in (rail.read, lambda: rail.write(OFF), lambda: spec.open_guarded(0)):
        with pytest.raises(HardwareError, match="all ones"):
            call()


def test_close_disables_the_motor_and_a_second_handle_only_lets_go(tmp_path):
    card, spec = emulated_rail(tmp_path)
    rail = spec.open()
    rail.write(MotorOutput(0.5, False, 2))
    guard = spec.open_guarded(1)
    guard.close()
    assert card.rail.output.duty == pytest.approx(0.5, abs=1e-3)
    rail.close()
    assert (card.rail.output.disabled, card.rail.output.duty, card.rail.output.light) == (True, 0.0, 0)
    assert card.violations == []


def test_wiring_file(tmp_path):
    file = tmp_path / "wiring.yaml"
    file.write_text("encoder: 2\nred: null\namperes_per_volt: 4\n")
    assert load_wiring(file) == Wiring(encoder=2, red=None, amperes_per_volt=4)
    for text, word in (("encodr: 1", "'encodr' is unknown"), ("pwm: 9", "'pwm' cannot be 9"), ("[1]", "name: value")):
        file.write_text(text)
        with pytest.raises(HardwareError, match=word):
            load_wiring(file)
    with pytest.raises(HardwareError, match="wiring file"):
        load_wiring(tmp_path / "none.yaml")


class CardClock(VirtualClock):
    """Ticks the loop on the emulated card; the rail runs under the levels of the card's pins."""

    def __init__(self, root, **options):
        self.card, spec = emulated_rail(root, **options)
        self.spec = spec
        super().__init__(RigLoop(spec.open(), LoopParameters()), self.card)


@pytest.mark.parametrize("wiring", [Wiring(), Wiring(encoder=3, pwm=4, direction=7, disable=6, current=5)])
def test_loop_homes_and_drives_8_rad_s_on_the_emulated_card(tmp_path, wiring):
    clock = CardClock(tmp_path, wiring=wiring, seed=3, position=-0.1)
    assert clock.run_command(Home(1)).success
    assert abs(clock.card.plant.position) < 1e-3
    result = clock.run_command(DriveSine(2, 0.15, 8.0, 2))
    assert result.success, result.message
    assert result.rms_error < 0.5e-3
    assert clock.card.violations == []
    assert clock.telemetry.mode == Mode.IDLE
    assert clock.card.rail.output.disabled


def test_guards_own_handle_brakes_the_card_when_the_loop_is_silent(tmp_path):
    clock = CardClock(tmp_path, seed=3, position=-0.1)
    assert clock.run_command(Home(1)).success
    guarded = clock.spec.open_guarded(1)
    guard = Guard(guarded, PlantParameters().drive)
    clock.loop.submit(DriveSine(2, 0.15, 8.0, 50))
    while clock.telemetry.elapsed < 2.5 or abs(clock.telemetry.velocity) < 1.15:
        clock.step()
        guard.tick(clock.now, clock.now)
    start, now, highest = clock.card.plant.position, clock.now, 0.0
    while not guard.at_rest:
        now += 0.002
        highest = max(highest, *np.abs(clock.card.advance(now)[:, 4]))
        guard.tick(now, clock.now)
        assert now - clock.now < 1.0
    assert guard.report.silence <= 0.016
    assert clock.card.plant.velocity == 0.0
    assert abs(clock.card.plant.position - start) < 0.06
    assert highest < 6.5
    assert clock.card.rail.output.disabled
    assert clock.card.violations == []


@pytest.fixture
def live(tmp_path, monkeypatch):
    """The loop process on an emulated card, homing; patient, since the machine may be busy."""
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(Path(__file__).resolve().parents[2]), *sys.path]))
    place = make_tree(tmp_path)
    card = CardRailSpec(LivePlace(place.uio_class, place.devices))
    parameters = LoopParameters(safety=SafetyLimits(deadline=5.0))
    telemetry = []
    loop = LoopProcess(ProcessSpec(parameters, guard=GuardLimits(timeout=2.0), card=card), telemetry.append)
    loop.wait_ready()
    _, result = loop.request(Home(loop.next_id()))
    wait_for(lambda: any(abs(t.velocity) > 0.2 for t in telemetry))
    yield loop, telemetry, result
    loop.close()


def registers(root):
    """DOUT's levels and the PWM counter's mode, as the processes left them in the device's file."""
    return page_of(root, 1).read16(0x10), page_of(root, 2).read32(0)


@pytest.mark.slow
def test_loop_process_on_the_card_leaves_it_disabled_and_dark(live, tmp_path):
    loop, telemetry, result = live
    wait_for(lambda: telemetry[-1].mode != Mode.HOMING)
    assert telemetry[-1].mode in (Mode.IDLE, Mode.FAULT), telemetry[-1].fault_text  # a busy machine may spoil homing
    assert result.done()
    assert loop.close() == 0
    assert registers(tmp_path) == (1 << Wiring().disable, 0x20)


@pytest.mark.slow
def test_loop_process_killed_the_guard_writes_the_registers(live, tmp_path):
    loop, _, _ = live
    guard = children(loop.pid)[0]
    os.kill(loop.pid, signal.SIGKILL)
    wait_for(lambda: not alive(guard))
    assert registers(tmp_path) == (1 << Wiring().disable | 1 << Wiring().red, 0x20)


def test_card_pulled_out_in_mid_run_is_a_fault(tmp_path):
    clock = CardClock(tmp_path, seed=3, position=-0.1)
    assert clock.run_command(Home(1)).success
    clock.loop.submit(DriveSine(2, 0.15, 8.0, 5))
    clock.run_for(2.5)
    clock.card.gone = True
    clock.step()
    assert clock.telemetry.fault == Fault.HARDWARE
