import math
import struct

import numpy as np
import pytest
from tests.driver import wire

from gsense_driver.covariances import white_noise_variance
from gsense_driver.errors import SettingError
from gsense_driver.frames import Frame, parse_payload
from gsense_driver.mounting import Mounting, parse_mounting
from gsense_driver.samples import (
    BatteryReading,
    FieldReading,
    ImuReading,
    OrientationReading,
    Sampler,
    TemperatureReading,
    gravity_in_sensor,
)
from gsense_driver.scaling import ScaleSettings, lisy_rate, mpu_temperature

DEG = math.pi / 180


def frame(kind: int, body: bytes, flags: int = 0, sequence: int = 0) -> Frame:
    out = parse_payload(wire.payload(kind, sequence, 0, body, flags))
    assert isinstance(out, Frame)
    return out


def first(readings, kind, sensor=None):
    return next(r for r in readings if isinstance(r, kind) and (sensor is None or r.sensor == sensor))


def sampler(status: bytes | None = None, settings: ScaleSettings | None = None, **mountings) -> Sampler:
    out = Sampler(settings or ScaleSettings(), mountings)
    if status is not None:
        out.take_status(frame(3, status))
    return out


@pytest.mark.parametrize(("fs", "lsb_per_dps"), list(enumerate([131.0, 65.5, 32.8, 16.4])))
@pytest.mark.parametrize(("afs", "lsb_per_g"), list(enumerate([16384, 8192, 4096, 2048])))
def test_mpu_scales_follow_status(fs, lsb_per_dps, afs, lsb_per_g):
    readings = sampler(wire.status_body(fs_sel=fs, afs_sel=afs)).readings(
        frame(1, wire.mpu_body(acc=(100, -200, 8192), gyr=(655, -3, 17))), 5
    )
    imu = first(readings, ImuReading, "mpu6050")
    assert imu.stamp_ns == 5
    assert imu.force == pytest.approx(np.array([100, -200, 8192]) / lsb_per_g * 9.80665)
    assert imu.rate == pytest.approx(np.array([655, -3, 17]) / lsb_per_dps * DEG)


def test_before_status_the_parameters_hold_and_afterwards_status():
    s = sampler(settings=ScaleSettings(mpu_gyro_range_dps=2000, mpu_accel_range_g=16))
    mpu = frame(1, wire.mpu_body(acc=(0, 0, 2048), gyr=(164, 0, 0)))
    assert first(s.readings(mpu, 0), ImuReading).force[2] == pytest.approx(9.80665)
    assert first(s.readings(mpu, 0), ImuReading).rate[0] == pytest.approx(10 * DEG)
    s.take_status(frame(3, wire.status_body(fs_sel=0, afs_sel=0)))
    assert first(s.readings(mpu, 0), ImuReading).force[2] == pytest.approx(9.80665 / 8)


def test_temperatures_and_lisy():
    assert mpu_temperature(-521) == pytest.approx(35.0, abs=0.01)  # the sheet's calibration point
    assert lisy_rate(8192) == pytest.approx(0.0, abs=1e-9)
    volts = 1.65 + 0.0033 * 100
    assert lisy_rate(round(volts / 3.3 * 16384)) == pytest.approx(100 * DEG, abs=0.1 * DEG)
    readings = sampler().readings(frame(1, wire.mpu_body(lisy=9000, temperature=-521)), 0)
    lisy = first(readings, ImuReading, "lisy300")
    assert lisy.force is None
    assert lisy.rate == pytest.approx((0, 0, (9000 * 3.3 / 16384 - 1.65) / 0.0033 * DEG))


def test_bno_scales_stamp_and_field():
    body = wire.bno_body(acc=(100, -50, 981), mag=(16, -32, 480), gyr=(16, -160, 1), age_us=2500)
    readings = sampler(wire.status_body()).readings(frame(2, body), 10_000_000)
    imu, field = first(readings, ImuReading), first(readings, FieldReading)
    assert imu.force == pytest.approx((1.0, -0.5, 9.81))
    assert imu.rate == pytest.approx((DEG, -10 * DEG, DEG / 16))
    assert field.field == pytest.approx((1e-6, -2e-6, 30e-6))
    assert {r.stamp_ns for r in readings} == {10_000_000 - 2_500_000}


@pytest.mark.parametrize(
    ("lsb", "unit_sel", "rate", "force"),
    [
        (16.0, 0x00, DEG, 1.0),
        (16.384, 0x00, 16 / 16.384 * DEG, 1.0),
        (16.0, 0x02, 16 / 900, 1.0),
        (16.384, 0x02, 16 / 16.384 * DEG, 1.0),
        (16.0, 0x01, DEG, 0.1 * 9.80665),
    ],
)
def test_bno_units_follow_parameter_and_unit_sel(lsb, unit_sel, rate, force):
    s = sampler(wire.status_body(unit_sel=unit_sel), ScaleSettings(bno_gyro_lsb_per_dps=lsb))
    imu = first(s.readings(frame(2, wire.bno_body(acc=(100, 0, 0), gyr=(16, 0, 0))), 0), ImuReading)
    assert imu.rate[0] == pytest.approx(rate)
    assert imu.force[0] == pytest.approx(force)


def test_a_repeated_bno_sample_is_published_and_counted_and_mag_only_when_changed():
    s = sampler()
    fields = 0
    for gyr, mag in [((1, 2, 3), (1, 1, 1)), ((1, 2, 3), (1, 1, 1)), ((1, 2, 4), (1, 1, 1)), ((1, 2, 4), (1, 1, 2))]:
        readings = s.readings(frame(2, wire.bno_body(gyr=gyr, mag=mag)), 0)
        assert first(readings, ImuReading)
        fields += sum(isinstance(r, FieldReading) for r in readings)
    assert fields == 2
    assert s.counts.repeated == 2
    assert s.counts.samples["bno055"] == 4


def test_a_repeated_bno_sample_is_never_stamped_before_itself():
    s = sampler()
    stamps = [
        first(s.readings(frame(2, wire.bno_body(age_us=age)), t), ImuReading).stamp_ns
        for t, age in [(20_000_000, 1000), (29_999_000, 11_000), (40_000_000, 1000)]
    ]
    assert stamps == [19_000_000, 19_000_000, 39_000_000]


def test_a_magnetometer_that_has_not_measured_is_not_published():
    readings = sampler().readings(frame(2, wire.bno_body(mag=(0, 0, 0))), 0)
    assert not [r for r in readings if isinstance(r, FieldReading)]


def test_failed_reads_give_no_sample_and_are_counted():
    s = sampler()
    assert s.readings(frame(1, wire.mpu_body(), flags=1), 0) == []
    assert s.readings(frame(2, wire.bno_body(), flags=1), 0) == []
    assert s.readings(frame(9, b""), 0) == []
    assert s.counts.read_failed == {"mpu6050": 1, "bno055": 1, "lisy300": 1}
    assert s.counts.unknown_type == 1


def test_ndof_gives_specific_force_from_gravity_and_linear_acceleration():
    half = math.sqrt(0.5)
    # Rolled by +90 deg about x: the sensor's y axis points up, so at rest it feels +g along y.
    assert gravity_in_sensor((half, half, 0.0, 0.0)) == pytest.approx((0, 9.80665, 0))
    raw = round(half * 16384)
    body = wire.ndof_body(quaternion=(raw, raw, 0, 0), linear=(100, 0, -200))
    reading = first(sampler().readings(frame(4, body), 7), OrientationReading)
    assert reading.force == pytest.approx((1.0, 9.80665, -2.0), abs=1e-3)
    assert reading.quaternion == pytest.approx((half, half, 0, 0), abs=1e-4)
    assert math.hypot(*reading.quaternion) == pytest.approx(1.0)


def test_gravity_agrees_with_the_rotation_matrix():
    rng = np.random.default_rng(3)
    for _ in range(20):
        w, x, y, z = q = rng.normal(size=4) / 1.0
        w, x, y, z = q / np.linalg.norm(q)
        r = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        assert gravity_in_sensor((w, x, y, z)) == pytest.approx(r.T @ [0, 0, 9.80665])


def test_a_fusion_that_does_not_run_yet_gives_nothing():
    s = sampler()
    assert s.readings(frame(4, wire.ndof_body(quaternion=(0, 0, 0, 0))), 0) == []
    assert s.counts.read_failed["bno055"] == 1


def test_temperatures_come_at_10_hz_and_the_battery_at_1_hz():
    s = sampler()
    out = [r for i in range(2000) for r in s.readings(frame(1, wire.mpu_body()), i * 5_000_000 + (i % 3) * 10_000)]
    assert sum(isinstance(r, TemperatureReading) for r in out) == 100
    battery = [r for r in out if isinstance(r, BatteryReading)]
    assert len(battery) == 10
    assert battery[0].volts == pytest.approx(3.9)


def test_mounting_rotates_and_refuses_mirrors():
    assert parse_mounting("x y z") == Mounting()
    assert parse_mounting("-y x z").apply((1.0, 2.0, 3.0)) == (-2.0, 1.0, 3.0)
    for bad in ("y x z", "x y", "x y w", "x x z", "--x y z"):
        with pytest.raises(SettingError, match="m: "):
            parse_mounting(bad, "m")
    readings = sampler(mpu6050=parse_mounting("-y x z")).readings(frame(1, wire.mpu_body(acc=(8192, 0, 0))), 0)
    assert first(readings, ImuReading, "mpu6050").force == pytest.approx((0, 9.80665, 0))


def test_variance_of_filtered_white_noise():
    """Against a simulated first-order low-pass."""
    rng = np.random.default_rng(1)
    rate, bandwidth, density = 20000.0, 42.0, 0.005
    white = rng.normal(size=400_000) * density * math.sqrt(rate / 2)
    alpha = 1 - math.exp(-2 * math.pi * bandwidth / rate)
    y, out = 0.0, np.empty(white.size)
    for i, v in enumerate(white.tolist()):
        y += alpha * (v - y)
        out[i] = y
    assert out[1000:].var() == pytest.approx(white_noise_variance(density, bandwidth), rel=0.1)


def test_big_endian_is_the_mpu_alone():
    body = struct.pack(">7h", 1, 2, 3, 0, 4, 5, 6) + bytes(8)
    imu = first(sampler().readings(frame(1, body), 0), ImuReading, "mpu6050")
    assert imu.force[0] == pytest.approx(9.80665 / 8192)
