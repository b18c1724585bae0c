"""Configuration registers of the chips, decoded: what the firmware has asked for.

Sources: InvenSense RM-MPU-6000A (register map), PS-MPU-6000A (delays); Bosch BST-BNO055-DS000, tables 3-5 to 3-14.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gsense_rig.sensors.constants import DEGREE, STANDARD_GRAVITY

MPU_SMPLRT_DIV, MPU_CONFIG, MPU_GYRO_CONFIG, MPU_ACCEL_CONFIG, MPU_PWR_MGMT_1 = 0x19, 0x1A, 0x1B, 0x1C, 0x6B
BNO_UNIT_SEL, BNO_OPR_MODE = 0x3B, 0x3D
BNO_ACC_CONFIG, BNO_MAG_CONFIG, BNO_GYR_CONFIG_0 = 0x08, 0x09, 0x0A
BNO_MODE_AMG = 0x07
BNO_FIRST_FUSION_MODE = 0x08

_MPU_GYRO_FILTER = ((256.0, 0.98), (188, 1.9), (98, 2.8), (42, 4.8), (20, 8.3), (10, 13.4), (5, 18.6), (256, 0.98))
_MPU_ACCEL_FILTER = ((260.0, 0.0), (184, 2.0), (94, 3.0), (44, 4.9), (21, 8.5), (10, 13.8), (5, 19.0), (260, 0.0))
"""By DLPF_CFG: bandwidth in Hz, delay in ms."""
_MPU_GYRO_LSB_PER_DPS = (131.0, 65.5, 32.8, 16.4)
_MPU_ACCEL_LSB_PER_G = (16384.0, 8192.0, 4096.0, 2048.0)

_BNO_GYRO = ((523.0, 1000.0), (230, 1000), (116, 1000), (47, 400), (23, 200), (12, 100), (64, 200), (32, 100))
"""By GYR_CONFIG_0 bits 5:3: bandwidth, rate in Hz (the image's 1 kHz is the highest)."""
_BNO_ACCEL_BANDWIDTH = (7.81, 15.63, 31.25, 62.5, 125.0, 250.0, 500.0, 1000.0)
_BNO_MAG_RATE = (2.0, 6.0, 8.0, 10.0, 15.0, 20.0, 25.0, 30.0)
_BNO_GYRO_RANGE = (2000.0, 1000.0, 500.0, 250.0, 125.0)
HIGHEST_RATE = 1000.0


@dataclass(frozen=True)
class FilterSpec:
    """A low-pass: -3 dB bandwidth (Hz) and delay at low frequency (s; None is that of a Butterworth)."""

    bandwidth: float
    delay: float | None = None


@dataclass(frozen=True)
class MpuConfig:
    """MPU-6050: registers 0x19 to 0x1C and the sleep bit."""

    dlpf: int = 3
    divider: int = 4
    fs_sel: int = 1
    afs_sel: int = 1
    asleep: bool = False

    @classmethod
    def from_registers(cls, registers: Sequence[int]) -> MpuConfig:
        """Decodes registers 0x00 to 0x7F (at least 0x6C of them)."""
        return cls(
            dlpf=registers[MPU_CONFIG] & 7,
            divider=registers[MPU_SMPLRT_DIV],
            fs_sel=registers[MPU_GYRO_CONFIG] >> 3 & 3,
            afs_sel=registers[MPU_ACCEL_CONFIG] >> 3 & 3,
            asleep=bool(registers[MPU_PWR_MGMT_1] & 0x40),
        )

    @property
    def gyro_scale(self) -> float:
        """LSB per rad/s."""
        return _MPU_GYRO_LSB_PER_DPS[self.fs_sel] / DEGREE

    @property
    def accel_scale(self) -> float:
        """LSB per m/s^2."""
        return _MPU_ACCEL_LSB_PER_G[self.afs_sel] / STANDARD_GRAVITY

    @property
    def gyro_filter(self) -> FilterSpec:
        """The digital low-pass of the gyro."""
        bandwidth, delay = _MPU_GYRO_FILTER[self.dlpf]
        return FilterSpec(bandwidth, delay * 1e-3)

    @property
    def accel_filter(self) -> FilterSpec:
        """The digital low-pass of the accelerometer."""
        bandwidth, delay = _MPU_ACCEL_FILTER[self.dlpf]
        return FilterSpec(bandwidth, delay * 1e-3 if delay else None)

    @property
    def rate(self) -> float:
        """Hz at which the registers are renewed (at most 1 kHz here)."""
        base = 8000.0 if self.dlpf in (0, 7) else 1000.0
        return min(HIGHEST_RATE, base / (1 + self.divider))


@dataclass(frozen=True)
class BnoConfig:
    """BNO055: mode, units and, in the raw modes, ranges and bandwidths."""

    mode: int = BNO_MODE_AMG
    unit_sel: int = 0x80
    acc_config: int = 0x0D
    mag_config: int = 0x0B
    gyr_config_0: int = 0x38

    @classmethod
    def from_registers(cls, page0: Sequence[int], page1: Sequence[int]) -> BnoConfig:
        """Decodes pages 0 and 1 (128 registers each)."""
        return cls(
            mode=page0[BNO_OPR_MODE] & 0x0F,
            unit_sel=page0[BNO_UNIT_SEL],
            acc_config=page1[BNO_ACC_CONFIG],
            mag_config=page1[BNO_MAG_CONFIG],
            gyr_config_0=page1[BNO_GYR_CONFIG_0],
        )

    @property
    def fuses(self) -> bool:
        """Whether the mode computes an orientation; such modes set ranges and rates themselves."""
        return self.mode >= BNO_FIRST_FUSION_MODE

    @property
    def gyro_scale(self) -> float:
        """LSB per rad/s: 900, or 16 per deg/s."""
        return 900.0 if self.unit_sel & 2 else 16.0 / DEGREE

    @property
    def gyro_range(self) -> float:
        """rad/s."""
        code = 0 if self.fuses else self.gyr_config_0 & 7
        return _BNO_GYRO_RANGE[min(code, len(_BNO_GYRO_RANGE) - 1)] * DEGREE

    @property
    def accel_scale(self) -> float:
        """LSB per m/s^2: 100, or 1 per mg."""
        return 1e3 / STANDARD_GRAVITY if self.unit_sel & 1 else 100.0

    @property
    def accel_range(self) -> float:
        """m/s^2."""
        return (4.0 if self.fuses else 2.0 * 2 ** (self.acc_config & 3)) * STANDARD_GRAVITY

    @property
    def gyro_filter(self) -> FilterSpec:
        """Low-pass of the gyro."""
        return FilterSpec(_BNO_GYRO[7 if self.fuses else self.gyr_config_0 >> 3 & 7][0])

    @property
    def gyro_rate(self) -> float:
        """Hz."""
        return 100.0 if self.fuses else _BNO_GYRO[self.gyr_config_0 >> 3 & 7][1]

    @property
    def accel_filter(self) -> FilterSpec:
        """Low-pass of the accelerometer."""
        return FilterSpec(_BNO_ACCEL_BANDWIDTH[3 if self.fuses else self.acc_config >> 2 & 7])

    @property
    def accel_rate(self) -> float:
        """Hz."""
        return min(HIGHEST_RATE, 100.0 if self.fuses else 2.0 * self.accel_filter.bandwidth)

    @property
    def mag_rate(self) -> float:
        """Hz."""
        return 20.0 if self.fuses else _BNO_MAG_RATE[self.mag_config & 7]


@dataclass(frozen=True)
class ChipConfig:
    """All chips; the default is what the firmware sets at start."""

    mpu: MpuConfig = MpuConfig()
    bno: BnoConfig = BnoConfig()


LISY_FILTER = FilterSpec(88.0)
"""LISY300AL: analogue, not configurable."""
