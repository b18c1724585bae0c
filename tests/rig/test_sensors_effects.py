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
    tone = rate(ideal("line_tone=0.02"), rest(5.0))[:, 0]
    f, power = signal.periodogram(tone[1000:], 1000.0)
    assert f[np.argmax(power)] == pytest.approx(31.3, abs=0.3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("nonsense=1", "unknown; known names: belt_tilt, bias"),
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


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_every_effect_changes_what_is_measured(name: str) -> None:
    history = sine(65.0, 6.0)
    effect = f"{name}={0.02 if name == 'time_offset' else 0.01}"
    others = () if name == "g_sensitivity" else ("g_sensitivity=0.001",)
    with_it, without = (ideal(*effects).advance(history).mpu for effects in ((effect, *others), others))
    assert not np.array_equal(with_it, without)
