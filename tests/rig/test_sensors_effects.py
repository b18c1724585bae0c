"""What the undeclared effects do to the measured rate and force, against figures computed here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from scipy.spatial.transform import Rotation
from tests.rig.sensor_unit import DEGREE, FAST, LSB, QUIET, G, clean, force, ideal, phasor, rate, rest, sine

from gsense_rig.sensors.chip_config import ChipConfig
from gsense_rig.sensors.effects import EFFECTS, parse_effects
from gsense_rig.sensors.mounting import Mounting
from gsense_rig.sensors.parameters import thesis_g_matrix
from gsense_rig.sensors.unit import SensorUnit, UnitSpec


def test_g_sensitivity_value_is_the_scalar_k_of_the_thesis() -> None:
    """Rate_x += k a_y, rate_y += k a_z, rate_z += k a_x (eq. 7.4)."""
    k = 0.001
    unit = ideal(f"g_sensitivity={k}")
    history = rest(0.3)
    history[:, 3] = 3.0
    assert rate(unit, history)[-1] == pytest.approx([0.0, k * G, k * 3.0], abs=1 / LSB)
    assert thesis_g_matrix(k) @ [1, 2, 3] == pytest.approx([2 * k, 3 * k, k])


def test_a_units_own_g_couples_the_specific_force() -> None:
    unit = SensorUnit(UnitSpec(site=QUIET))
    matrix = unit.parameters.mpu_gyro.g_sensitivity
    assert np.linalg.norm(matrix) == pytest.approx(np.sqrt(3) * 0.1 * DEGREE / 9.80665, rel=0.6)
    own = replace(clean(unit.parameters), mpu_gyro=replace(clean(unit.parameters).mpu_gyro, g_sensitivity=matrix))
    unit = SensorUnit(UnitSpec(site=QUIET), own)
    unit.mount(Mounting("0", misalignment=0.0))
    unit.configure(ChipConfig(mpu=FAST))
    history = rest(0.3)
    history[:, 3] = -4.0
    assert rate(unit, history)[-1] == pytest.approx(matrix @ [-4.0, 0.0, G], abs=0.6 / LSB)


@pytest.mark.parametrize("mounting", ["0", "180", "tilt_x"])
def test_rail_curvature_is_a_true_rotation(mounting: str) -> None:
    """Attitude exp([t s]x): the rate is its derivative, and gravity and the Earth's field turn."""
    bend, w = 0.02, 4.0
    unit = ideal(f"rail_curvature={bend}", mounting=mounting)
    history = sine(4.0, w)
    turn = Mounting(mounting, misalignment=0.0).board_from_carriage()
    t = history[1000:, 0] - unit.config.mpu.gyro_filter.delay
    expected = turn @ np.full(3, bend * 0.15 * w)
    measured = [phasor(x, w, t).real for x in rate(unit, history)[1000:].T]
    assert measured == pytest.approx(expected, rel=0.01)
    at_end = rest(1.0, position=0.2)
    carriage = Rotation.from_rotvec(np.full(3, bend * 0.2))
    unit = ideal(f"rail_curvature={bend}", mounting=mounting)
    registers = unit.advance(at_end)
    tilted = turn @ carriage.inv().apply([0, 0, G])
    assert registers.mpu[-1, :3] / unit.config.mpu.accel_scale == pytest.approx(tilted, abs=1e-3)
    field = turn @ carriage.inv().apply(QUIET.magnetic_field())
    assert registers.bno[-1, 3:6] / 16e6 == pytest.approx(field, abs=0.6 / 16e6)


def test_integral_of_the_rate_is_the_turn_on_a_bent_rail() -> None:
    bend = 0.05
    unit = ideal(f"rail_curvature={bend}")
    t = np.arange(3000) * 1e-3
    ramp = np.clip(t - 0.5, 0, 1.5)
    s = 0.1 * (1 - np.cos(np.pi * ramp / 1.5))
    v = np.gradient(s, 1e-3)
    history = np.column_stack([t, s, v, np.gradient(v, 1e-3), 0 * t])
    assert rate(unit, history).sum(axis=0) * 1e-3 == pytest.approx(np.full(3, bend * 0.2), rel=0.02)


def test_belt_tilt_leans_with_the_acceleration() -> None:
    c = 1e-3
    history = rest(0.5)
    history[:, 3] = 5.0
    unit = ideal(f"belt_tilt={c}")
    expected = np.add(Rotation.from_rotvec([5 * c] * 3).inv().apply([0, 0, G]), [5.0, 0.0, 0.0])
    assert force(unit, history)[-1] == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("tau", [0.0, 0.003, 0.0204])
def test_time_offset_delays_the_gyro_against_the_accelerometer(tau: float) -> None:
    w = 8.0
    unit = ideal("g_sensitivity=0.01", f"time_offset={tau}", dlpf=3)
    history = sine(5.0, w)
    registers = unit.advance(history)
    t = history[1000:, 0]
    gyro = phasor(registers.mpu[1000:, 6].astype(float), w, t)
    accel = phasor(registers.mpu[1000:, 0].astype(float), w, t)
    later = np.angle(accel / gyro) / w
    datasheet = unit.config.mpu.gyro_filter.delay - unit.config.mpu.accel_filter.delay
    assert later == pytest.approx(tau + datasheet, abs=1e-4)


def test_temperature_bias_follows_the_lagged_die() -> None:
    c = 0.01
    unit = ideal(f"temperature_bias={c}")
    thermal = unit.parameters.thermal
    registers = unit.advance(rest(120.0))
    t = registers.time
    die = thermal.ambient + thermal.rise * (1 - np.exp(-t / thermal.time_constant))
    shown = registers.mpu[:, 3] / 340.0 + 36.53
    assert shown[2000:] == pytest.approx(die[2000:], abs=0.01)
    lag = signal.lfilter([1e-3 / thermal.gyro_lag], [1, 1e-3 / thermal.gyro_lag - 1], die - die[0]) + die[0]
    measured = registers.mpu[:, 4] / unit.config.mpu.gyro_scale
    assert measured[2000:] == pytest.approx(c * (lag[2000:] - 25.0), abs=1.5 / LSB)


@pytest.mark.parametrize(
    ("effect", "expected"),
    [
        ("g_squared=0.002", 0.002 * 16),
        ("speed_pickup=0.02", 0.02 * 0.7),
        ("friction_pickup=0.01", 0.01),
        ("bias=0.05", 0.05),
    ],
)
def test_effects_that_are_one_term(effect: str, expected: float) -> None:
    history = rest(0.3)
    history[:, 2], history[:, 3] = 0.7, 4.0
    assert rate(ideal(effect), history)[-1] == pytest.approx([expected] * 3, abs=0.6 / LSB)


def test_bias_jump_and_line_tone_in_time() -> None:
    x = rate(ideal("bias_jump=0.02"), rest(61.0))[:, 1]
    assert x[59_000] == 0
    assert x[60_900] == pytest.approx(0.02, abs=1 / LSB)
    driven = rest(5.0)
    driven[:, 4] = 0.1
    tone = rate(ideal("line_tone=0.02"), driven)[:, 0]
    f, power = signal.periodogram(tone[1000:], 1000.0)
    assert f[np.argmax(power)] == pytest.approx(31.3, abs=0.3)
    assert not rate(ideal("line_tone=0.02"), rest(1.0)).any()  # the motor is off


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense=1", "unknown; known names: accel_clipping, belt_tilt"),
        ("bias", "NAME=VALUE"),
        ("bias=x", "not a finite number"),
        ("bias=nan", "not a finite number"),
    ],
)
def test_wrong_effects_are_one_line(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words) as error:
        parse_effects([text])
    assert "\n" not in str(error.value)


def test_effects_are_given_once_and_within_reason() -> None:
    with pytest.raises(ValueError, match="2 times"):
        parse_effects(["bias=1", "bias=2"])
    with pytest.raises(ValueError, match="time_offset must be"):
        SensorUnit(UnitSpec(effects=("time_offset=0.5",)))


@pytest.mark.parametrize(("mounting", "sign"), [("0", 1.0), ("180", -1.0)])
def test_cubic_sensitivity_turns_with_the_board(mounting: str, sign: float) -> None:
    history = rest(0.3)
    history[:, 3] = 4.0
    expected = sign * 0.001 * 64.0
    assert rate(ideal("g_cubed=0.001", mounting=mounting), history)[-1] == pytest.approx([expected] * 3, abs=0.6 / LSB)


def test_mount_resonance_answers_as_a_second_order_system() -> None:
    """9 Hz, damping 0.08: nearly static far below, with the phase of a resonance on it."""
    c = 0.01
    for hertz in (1.0, 9.0):
        w = 2.0 * np.pi * hertz
        t = np.arange(6000) * 1e-3
        history = np.column_stack([t, 0 * t, 0 * t, np.cos(w * t), 0 * t])
        unit = ideal("g_resonance=0.01")
        measured = phasor(rate(unit, history)[4000:, 0], w, t[4000:] - unit.config.mpu.gyro_filter.delay)
        ratio = hertz / 9.0
        assert measured == pytest.approx(c / (1.0 - ratio**2 + 0.16j * ratio), rel=0.06)


def test_rock_turns_by_twice_its_value_at_each_reversal() -> None:
    r, w = 0.002, 4.0
    unit = ideal("reversal_rock=0.002")
    history = sine(6.0, w)
    turned = np.cumsum(rate(unit, history)[:, 0]) * 1e-3
    middles = [round((k + 0.5) * np.pi / w * 1000 + np.pi / w * 500) for k in range(1, 6)]  # amid the strokes
    steps = np.diff(turned[middles])
    assert np.abs(steps) == pytest.approx(np.full(4, 2 * r), rel=0.03)
    assert np.all(np.sign(steps[1:]) == -np.sign(steps[:-1]))


def test_belt_teeth_sound_at_speed_over_pitch() -> None:
    history = rest(4.0)
    history[:, 1] = 0.1 * history[:, 0]
    history[:, 2] = 0.1
    f, power = signal.periodogram(rate(ideal("belt_tooth=0.02"), history)[1000:, 2], 1000.0, scaling="spectrum")
    peak = int(np.argmax(power))
    assert f[peak] == pytest.approx(0.1 / 0.005, abs=0.3)
    assert np.sqrt(2.0 * power[peak - 2 : peak + 3].sum()) == pytest.approx(0.02, rel=0.05)


def test_speed_noise_grows_with_the_speed_and_has_no_mean() -> None:
    unit = ideal("speed_noise=0.01")
    spread = []
    for speed in (0.0, 0.5, 1.0):
        history = rest(20.0)
        history[:, 2] = speed
        x = rate(unit, history)[500:]
        spread.append(x.std())
        assert np.abs(x.mean(axis=0)).max() < 0.002
    assert spread[0] < 1 / LSB
    assert spread[2] == pytest.approx(2.0 * spread[1], rel=0.1)
    assert 0.007 < spread[2] < 0.0105  # the sensor's filter takes a part
    assert abs(np.corrcoef(x.T)[0, 1]) < 0.1


def test_supply_follows_the_cell() -> None:
    unit = ideal("supply_voltage=0.02")
    cell = unit.parameters.supply.cell
    assert rate(unit, rest(0.5))[-1] == pytest.approx([0.02 * (cell - 4.2)] * 3, abs=1.1 / LSB)


def test_field_of_steel_and_motor() -> None:
    field = QUIET.magnetic_field()
    history = rest(0.5, position=0.1)
    history[:, 4] = 2.0
    for effect, change in (("mag_position=1e-4", 1e-5), ("mag_motor=3e-6", 6e-6)):
        registers = ideal(effect, mounting="180").advance(history)
        expected = Mounting("180", misalignment=0.0).board_from_carriage() @ (field + change)
        assert registers.bno[-1, 3:6] / 16e6 == pytest.approx(expected, abs=0.6 / 16e6)


def test_clipping_and_coarse_steps() -> None:
    history = sine(2.0, 8.0)
    clipped = force(ideal("accel_clipping=5"), history)
    assert np.abs(clipped[:, 0]).max() == pytest.approx(5.0, abs=0.01)
    assert np.count_nonzero(clipped[:, 0] > 4.99) > 100
    history[:, 2] *= 2.0
    x = rate(ideal("speed_pickup=1", "gyro_clipping=0.5"), history)
    assert np.abs(x).max() == pytest.approx(0.5, abs=2 / LSB)
    coarse = rate(ideal("speed_pickup=0.1", "quantization=0.01"), history)
    steps = np.diff(np.unique(coarse))
    assert steps == pytest.approx(np.full(steps.shape, 0.01), abs=1 / LSB)


@pytest.mark.parametrize(
    "text", ["accel_clipping=0", "speed_noise=-1", "clock_skew=0.5", "sample_loss=1", "quantization=-1"]
)
def test_values_that_make_no_sense(text: str) -> None:
    with pytest.raises(ValueError, match=text.partition("=")[0]) as error:
        SensorUnit(UnitSpec(effects=(text,)))
    assert "\n" not in str(error.value)


BEHIND_THE_CHIPS = {"sample_loss", "clock_skew", "encoder_scale"}


@pytest.mark.parametrize("name", sorted(EFFECTS.keys() - BEHIND_THE_CHIPS))
def test_every_effect_changes_what_is_measured(name: str) -> None:
    history = sine(65.0, 6.0)
    history[:, 4] = 1.0
    effect = f"{name}={0.02 if name == 'time_offset' else 0.01}"
    others = () if name == "g_sensitivity" else ("g_sensitivity=0.01",)
    with_it, without = (ideal(*effects).advance(history) for effects in ((effect, *others), others))
    assert not (np.array_equal(with_it.mpu, without.mpu) and np.array_equal(with_it.bno, without.bno))
