"""The chips: ranges, filters, noise and clocks, against figures computed here, independently of the kernel."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy import signal
from scipy.spatial.transform import Rotation
from tests.rig.sensor_unit import DEGREE, FAST, LSB, QUIET, G, clean, ideal, phasor, rate, rest, sine

from gsense_rig.sensors.chip_config import BnoConfig, ChipConfig, MpuConfig
from gsense_rig.sensors.parameters import UnitParameters
from gsense_rig.sensors.unit import SensorUnit, UnitSpec


def test_at_rest_a_level_board_feels_gravity_upwards_and_no_rate() -> None:
    unit = ideal()
    registers = unit.advance(rest(0.5))
    assert registers.mpu[-1, :3] / unit.config.mpu.accel_scale == pytest.approx([0, 0, G], abs=1e-3)
    assert registers.mpu[-1, 4:].tolist() == [0, 0, 0]
    assert registers.bno[-1, :3] / 100 == pytest.approx([0, 0, G], abs=0.01)
    assert registers.lisy[-1].sum() * 3.3 / 16384 == pytest.approx(1.65, abs=3.3 / 1024)


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
