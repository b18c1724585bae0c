"""Scales and bandwidths of the sensors, from the configuration that STATUS frames report.

Sources: MPU-6050 register map RM-MPU-6000A and specification PS-MPU-6000A (scales, DLPF table), BNO055 data sheet
BST-BNO055-DS000 (unit selection, configuration registers), LISY300AL data sheet (3.3 mV per deg/s, 1.65 V at rest).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from gsense_driver.frames import StatusBody

G = 9.80665  # m/s^2
DEG = math.pi / 180.0

_MPU_GYRO_LSB_PER_DPS = (131.0, 65.5, 32.8, 16.4)
_MPU_ACCEL_LSB_PER_G = (16384.0, 8192.0, 4096.0, 2048.0)
_MPU_GYRO_BANDWIDTH_HZ = (256.0, 188.0, 98.0, 42.0, 20.0, 10.0, 5.0, 256.0)
_MPU_ACCEL_BANDWIDTH_HZ = (260.0, 184.0, 94.0, 44.0, 21.0, 10.0, 5.0, 260.0)
_BNO_ACCEL_BANDWIDTH_HZ = (7.81, 15.63, 31.25, 62.5, 125.0, 250.0, 500.0, 1000.0)  # ACC_CONFIG 4:2
_BNO_GYRO_BANDWIDTH_HZ = (523.0, 230.0, 116.0, 47.0, 23.0, 12.0, 64.0, 32.0)  # GYR_CONFIG_0 5:3

MPU_GYRO_RANGES_DPS = (250, 500, 1000, 2000)
MPU_ACCEL_RANGES_G = (2, 4, 8, 16)


@dataclass(frozen=True)
class Scales:
    """SI per count, and -3 dB bandwidths in Hz. The defaults hold until the first STATUS frame."""

    mpu_gyro: float = DEG / 65.5  # rad/s
    mpu_accel: float = G / 8192.0  # m/s^2
    mpu_gyro_bandwidth_hz: float = 42.0
    mpu_accel_bandwidth_hz: float = 44.0
    bno_gyro: float = DEG / 16.0  # rad/s
    bno_accel: float = 0.01  # m/s^2
    bno_mag: float = 1.0 / 16e6  # T
    bno_gyro_bandwidth_hz: float = 32.0
    bno_accel_bandwidth_hz: float = 62.5
    bno_temperature: float = 1.0  # degrees Celsius per count


@dataclass(frozen=True)
class ScaleSettings:
    """The driver's parameters that bear on scales."""

    mpu_gyro_range_dps: int = 500  # until the first STATUS frame
    mpu_accel_range_g: int = 4  # until the first STATUS frame
    bno_gyro_lsb_per_dps: float = 16.0  # 16: as UNIT_SEL says; any other value: taken as it is, whatever UNIT_SEL says
    bno_accel_lsb_per_mps2: float = 100.0  # until the first STATUS frame
    bno_mag_lsb_per_ut: float = 16.0


def scales_before_status(settings: ScaleSettings) -> Scales:
    """Scales by the parameters alone."""
    return Scales(
        mpu_gyro=DEG / _MPU_GYRO_LSB_PER_DPS[MPU_GYRO_RANGES_DPS.index(settings.mpu_gyro_range_dps)],
        mpu_accel=G / _MPU_ACCEL_LSB_PER_G[MPU_ACCEL_RANGES_G.index(settings.mpu_accel_range_g)],
        bno_gyro=DEG / settings.bno_gyro_lsb_per_dps,
        bno_accel=1.0 / settings.bno_accel_lsb_per_mps2,
        bno_mag=1e-6 / settings.bno_mag_lsb_per_ut,
    )


def scales_from_status(status: StatusBody, settings: ScaleSettings) -> Scales:
    """Scales by the configuration that the board reports.

    The BNO055's registers keep their unit whatever the range; UNIT_SEL bit 0 selects mg, bit 1 rad/s, bit 4 Fahrenheit.
    """
    unit = status.bno_unit_sel
    bno_gyro = DEG / settings.bno_gyro_lsb_per_dps
    if unit & 0x02 and settings.bno_gyro_lsb_per_dps == 16.0:
        bno_gyro = 1.0 / 900.0
    dlpf = status.mpu_dlpf_cfg & 0x07
    return replace(
        scales_before_status(settings),
        mpu_gyro=DEG / _MPU_GYRO_LSB_PER_DPS[status.mpu_fs_afs >> 4 & 0x03],
        mpu_accel=G / _MPU_ACCEL_LSB_PER_G[status.mpu_fs_afs & 0x03],
        mpu_gyro_bandwidth_hz=_MPU_GYRO_BANDWIDTH_HZ[dlpf],
        mpu_accel_bandwidth_hz=_MPU_ACCEL_BANDWIDTH_HZ[dlpf],
        bno_gyro=bno_gyro,
        bno_accel=G / 1000.0 if unit & 0x01 else 0.01,
        bno_gyro_bandwidth_hz=_BNO_GYRO_BANDWIDTH_HZ[status.bno_gyr_config_0 >> 3 & 0x07],
        bno_accel_bandwidth_hz=_BNO_ACCEL_BANDWIDTH_HZ[status.bno_acc_config >> 2 & 0x07],
        bno_temperature=2.0 if unit & 0x10 else 1.0,
    )


def mpu_temperature(raw: int) -> float:
    """Die temperature of the MPU-6050 in degrees Celsius."""
    return raw / 340.0 + 36.53


def lisy_rate(conversions_sum: int) -> float:
    """Rate of the LISY300AL in rad/s, from the sum of 16 conversions of 10 bits against 3.3 V."""
    return (conversions_sum * (3.3 / 16384.0) - 1.65) / 0.0033 * DEG
