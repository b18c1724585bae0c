"""A simulated board without errors of its own, and motions and measures for its tests."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gsense_rig.sensors.chip_config import ChipConfig, MpuConfig
from gsense_rig.sensors.mounting import Mounting, Site
from gsense_rig.sensors.parameters import UnitParameters
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
