"""The sensors' physics against figures computed here, independently of the kernel."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy import signal
from scipy.spatial.transform import Rotation

from gsense_rig.sensors.chip_config import BnoConfig, ChipConfig, MpuConfig
from gsense_rig.sensors.effects import EFFECTS, parse_effects
from gsense_rig.sensors.mounting import MOUNTINGS, Mounting, Site
from gsense_rig.sensors.parameters import UnitParameters, thesis_g_matrix
from gsense_rig.sensors.unit import SensorUnit, UnitSpec

DEGREE = np.pi / 180
G = 9.81
QUIET = Site(gravity=G, earth_rate=0.0)
FAST = MpuConfig(dlpf=1, divider=0, fs_sel=0, afs_sel=0)
LSB = 131.0 / DEGREE


def clean(unit: UnitParameters) -> UnitParameters:
    """The unit without noise, bias, scale errors and own G."""
    eye, zero = np.eye(3), np.zeros(3)
    gyros = {
        name: replace(
            getattr(unit, name),
            bias=zero,
            matrix=eye,
            g_sensitivity=np.zeros((3, 3)),
            noise_density=0.0,
            flicker=0.0,
            random_walk=0.0,
        )
        for name in ("mpu_gyro", "bno_gyro", "lisy_gyro")
    }
    accels = {
        name: replace(getattr(unit, name), bias=zero, matrix=eye, noise_density=0.0)
        for name in ("mpu_accelerometer", "bno_accelerometer")
    }
    thermal = replace(unit.thermal, wander=0.0, register_noise=0.0)
    magnetometer = replace(unit.magnetometer, hard_iron=zero, matrix=eye, noise=0.0)
    supply = replace(unit.supply, regulator=3.3, converter_noise=0.0)
    return replace(
        unit, **gyros, **accels, thermal=thermal, magnetometer=magnetometer, supply=supply, mpu_clock_skew=0.0
    )


def ideal(*effects: str, mounting: str = "0", **config: Any) -> SensorUnit:
    unit = SensorUnit(UnitSpec(effects=effects, site=QUIET), clean(UnitParameters.draw(1)))
    unit.mount(Mounting(mounting, misalignment=0.0))
    unit.configure(ChipConfig(mpu=replace(FAST, **config)))
    return unit


def sine(seconds: float, w: float, amplitude: float = 0.15) -> np.ndarray:
    t = np.arange(round(seconds * 1000)) * 1e-3
    s, c = np.sin(w * t), np.cos(w * t)
    return np.column_stack([t, amplitude * s, amplitude * w * c, -amplitude * w * w * s, 0 * t])


def rest(seconds: float, position: float = 0.0) -> np.ndarray:
    history = np.zeros((round(seconds * 1000), 5))
    history[:, 0] = np.arange(history.shape[0]) * 1e-3
    history[:, 1] = position
    return history


def rate(unit: SensorUnit, history: np.ndarray) -> np.ndarray:
    return unit.advance(history).mpu[:, 4:7] / unit.config.mpu.gyro_scale


def force(unit: SensorUnit, history: np.ndarray) -> np.ndarray:
    return unit.advance(history).mpu[:, :3] / unit.config.mpu.accel_scale


def phasor(x: np.ndarray, w: float, t: np.ndarray) -> complex:
    """Amplitude and phase at w: x = Re(p exp(i w t))."""
    design = np.column_stack([np.cos(w * t), -np.sin(w * t), np.ones_like(t)])
    c, s, _ = np.linalg.lstsq(design, x, rcond=None)[0]
    return complex(c, s)


def test_at_rest_a_level_board_feels_gravity_upwards_and_no_rate() -> None:
    unit = ideal()
    registers = unit.advance(rest(0.5))
    assert registers.mpu[-1, :3] / unit.config.mpu.accel_scale == pytest.approx([0, 0, G], abs=1e-3)
    assert registers.mpu[-1, 4:].tolist() == [0, 0, 0]
    assert registers.bno[-1, :3] / 100 == pytest.approx([0, 0, G], abs=0.01)
    assert registers.lisy[-1].sum() * 3.3 / 16384 == pytest.approx(1.65, abs=3.3 / 1024)


@pytest.mark.parametrize(
    ("mounting", "up", "forward"),
    [
        ("0", [0, 0, 1], [1, 0, 0]),
        ("180", [0, 0, 1], [-1, 0, 0]),
        ("90", [0, 0, 1], [0, -1, 0]),
        ("tilt_x", [0, 1, 0], [1, 0, 0]),
        ("tilt_y", [-1, 0, 0], [0, 0, 1]),
    ],
)
def test_mountings_turn_gravity_and_acceleration(mounting: str, up: list[float], forward: list[float]) -> None:
    assert force(ideal(mounting=mounting), rest(0.2))[-1] == pytest.approx(G * np.array(up), abs=1e-3)
    steady = rest(0.2)
    steady[:, 3] = 2.0
    expected = G * np.array(up) + 2.0 * np.array(forward)
    assert force(ideal(mounting=mounting), steady)[-1] == pytest.approx(expected, abs=1e-3)


def test_every_mounting_name_is_tested_above() -> None:
    assert set(MOUNTINGS) == {"0", "180", "90", "tilt_x", "tilt_y"}


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


@pytest.mark.parametrize(
    ("dlpf", "bandwidth", "delay"),
    [(1, 188, 1.9), (2, 98, 2.8), (3, 42, 4.8), (4, 20, 8.3), (5, 10, 13.4), (6, 5, 18.6)],
)
def test_the_gyros_low_pass_has_the_data_sheets_bandwidth_and_delay(dlpf: int, bandwidth: float, delay: float) -> None:
    """Measured through the whole path: a tilt of the carriage as the test signal."""

    def response(frequency: float) -> complex:
        w = 2 * np.pi * frequency
        unit = ideal("speed_pickup=1.0", dlpf=dlpf)
        history = sine(3.0, w, amplitude=3.0 / w)
        t = history[1500:, 0]
        return phasor(rate(unit, history)[1500:, 2], w, t) / 3.0

    assert abs(response(bandwidth)) == pytest.approx(np.sqrt(0.5), rel=0.02)
    low = bandwidth / 20
    assert -np.angle(response(low)) / (2 * np.pi * low) * 1e3 == pytest.approx(delay, rel=0.02)


def test_white_noise_has_the_data_sheets_density_after_the_filter() -> None:
    parameters = clean(UnitParameters.draw(3))
    parameters = replace(
        parameters,
        mpu_gyro=replace(parameters.mpu_gyro, noise_density=0.005 * DEGREE),
        mpu_accelerometer=replace(parameters.mpu_accelerometer, noise_density=400e-6 * 9.80665),
    )
    unit = SensorUnit(UnitSpec(site=QUIET), parameters)
    unit.configure(ChipConfig(mpu=MpuConfig(dlpf=3, divider=4, fs_sel=0, afs_sel=0)))
    registers = unit.advance(rest(120.0)).mpu[1000::5]
    for columns, scale, density in (
        (slice(4, 7), unit.config.mpu.gyro_scale, 0.005 * DEGREE),
        (slice(0, 3), unit.config.mpu.accel_scale, 400e-6 * 9.80665),
    ):
        f, spectrum = signal.welch(registers[:, columns] / scale, 200.0, nperseg=1024, axis=0)
        band = (f > 1) & (f < 15)
        assert np.sqrt(spectrum[band].mean()) == pytest.approx(density, rel=0.05)


def test_flicker_has_its_allan_floor() -> None:
    parameters = clean(UnitParameters.draw(3))
    floor = 0.02 * DEGREE  # large against quantisation
    unit = SensorUnit(UnitSpec(site=QUIET), replace(parameters, mpu_gyro=replace(parameters.mpu_gyro, flicker=floor)))
    unit.configure(ChipConfig(mpu=replace(FAST, divider=9)))
    x = unit.advance(rest(200.0)).mpu[::10, 4:7] / unit.config.mpu.gyro_scale
    deviations = []
    for seconds in (0.5, 1.5):
        m = round(seconds * 100)
        means = x[: len(x) // m * m].reshape(-1, m, 3).mean(axis=1)
        deviations.append(np.sqrt(0.5 * np.mean(np.diff(means, axis=0) ** 2)))
    assert deviations == pytest.approx([floor, floor], rel=0.25)


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


def test_clips_and_quantises_to_the_configured_range() -> None:
    unit = ideal("bias=10.0", fs_sel=1)  # 573 deg/s against +-500
    assert unit.advance(rest(0.3)).mpu[-1, 4:].tolist() == [32767] * 3
    unit = ideal("bias=-10.0", fs_sel=1)
    assert unit.advance(rest(0.3)).mpu[-1, 4:].tolist() == [-32768] * 3
    unit = ideal(f"bias={10.3 / LSB}")
    assert unit.advance(rest(0.3)).mpu[-1, 4:].tolist() == [10] * 3
    history = rest(0.3)
    history[:, 3] = 30.0
    assert ideal(afs_sel=0).advance(history).mpu[-1, 0] == 32767


def test_sample_and_hold_at_the_chips_rates() -> None:
    unit = SensorUnit(UnitSpec())
    registers = unit.advance(sine(10.0, 6.0))
    changes = np.flatnonzero(np.any(np.diff(registers.mpu, axis=0) != 0, axis=1))
    assert set(np.diff(changes)) <= {5, 6, 10}  # 200 Hz; one step more where the oscillators slip
    assert len(changes) == pytest.approx(2000, abs=2)
    assert np.count_nonzero(np.diff(registers.bno_time)) == pytest.approx(1000, abs=5)
    mag = np.count_nonzero(np.any(np.diff(registers.bno[:, 3:6], axis=0) != 0, axis=1))
    assert 80 <= mag <= 101


def test_state_is_carried_whatever_the_calls() -> None:
    spec = UnitSpec(effects=("time_offset=0.0123", "temperature_bias=0.001", "rail_curvature=0.01"))
    history = sine(1.0, 7.0)
    whole = SensorUnit(spec).advance(history)
    unit = SensorUnit(spec)
    cuts = [0, 1, 3, 5, 400, 401, 1000]
    pieces = [unit.advance(history[a:b]) for a, b in pairwise(cuts)]
    for name in whole._fields:
        assert np.array_equal(getattr(whole, name), np.concatenate([getattr(p, name) for p in pieces])), name


def test_seeds_repeat_and_differ() -> None:
    a, b, c = (SensorUnit(UnitSpec(noise_seed=n)).advance(rest(0.2)).mpu for n in (1, 1, 2))
    assert np.array_equal(a, b)
    assert not np.array_equal(a, c)
    one, two = UnitParameters.draw(1), UnitParameters.draw(2)
    assert not np.array_equal(one.mpu_gyro.bias, two.mpu_gyro.bias)


def test_the_converters_reference_scales_the_lisy300() -> None:
    parameters = clean(UnitParameters.draw(1))
    high = replace(parameters, supply=replace(parameters.supply, regulator=3.3 * 1.01))
    unit = SensorUnit(UnitSpec(site=QUIET), high)
    volts = unit.advance(rest(0.1)).lisy[-1].mean() * 3.3 / 1024
    assert (volts - 1.65) / 0.0033 == pytest.approx(-5.0, abs=1.5)  # deg/s: 1 % of the supply, in steps of 1 LSB


def test_a_sleeping_chip_renews_nothing_and_ndof_reports_gravity() -> None:
    unit = ideal(asleep=True)
    assert not unit.advance(rest(0.1)).mpu.any()
    unit = ideal(mounting="tilt_x")
    unit.configure(ChipConfig(bno=BnoConfig(mode=0x0C)))
    history = rest(0.5)
    history[:, 3] = 1.0
    bno = unit.advance(history).bno[-1]
    assert bno[19:22] / 100 == pytest.approx([0, G, 0], abs=0.01)
    assert bno[16:19] / 100 == pytest.approx([1, 0, 0], abs=0.02)
    w, x, y, z = bno[12:16] / 16384
    assert Rotation.from_quat([x, y, z, w]).apply([0, 1, 0]) == pytest.approx([0, 0, 1], abs=1e-3)  # board y is up


def test_earth_rate_turns_with_the_board() -> None:
    site = Site(latitude=50 * DEGREE, azimuth=0.0)
    north, up = 7.292115e-5 * np.cos(50 * DEGREE), 7.292115e-5 * np.sin(50 * DEGREE)
    assert site.rotation_rate() == pytest.approx([north, 0, up])


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
