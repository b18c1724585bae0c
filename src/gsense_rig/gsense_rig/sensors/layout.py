"""How the kernel's arrays are arranged: channels, noise columns, settings and state.

Settings do not change while the kernel runs; the state is all that it carries from step to step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gsense_rig.sensors.drivers import GyroDriver

Array = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

GYRO_CHIP = np.array([0, 0, 0, 1, 1, 1, 2])
GYRO_AXIS = np.array([0, 1, 2, 0, 1, 2, 2])
GYROS = 7
"""Gyro channels: MPU x y z, BNO x y z, LISY z."""
ACCELS = 6
"""Accelerometer channels: MPU x y z, BNO x y z."""
CHANNELS = GYROS + ACCELS
FILTER_OF = np.array([0, 0, 0, 1, 1, 1, 2, 3, 3, 3, 4, 4, 4])
"""Channel to filter: MPU gyro, BNO gyro, LISY, MPU accelerometer, BNO accelerometer."""
FLICKER_TIMES = (0.1, 1.0, 10.0, 100.0, 1000.0)
"""s: time constants of the first-order processes whose sum has a 1/f spectrum."""
FLICKERS = len(FLICKER_TIMES)
RING = 256
"""Steps of the delay line."""

NOISE_WHITE = 0
NOISE_FLICKER = NOISE_WHITE + CHANNELS
NOISE_WALK = NOISE_FLICKER + GYROS * FLICKERS
NOISE_MAG = NOISE_WALK + GYROS
NOISE_THERMAL = NOISE_MAG + 3  # ambient, MPU register
NOISE_ADC = NOISE_THERMAL + 2  # 16 conversions of the LISY300, 1 of the cell
NOISE_COLUMNS = NOISE_ADC + 17
NOISE_RATTLE = NOISE_COLUMNS
RATTLE_COLUMNS = 3
"""Appended only where an effect wants them, so that all other sessions keep their bytes."""

HOLDS = 4
"""Sample-and-hold clocks: MPU, BNO gyro, BNO accelerometer, BNO magnetometer."""


class Settings(NamedTuple):
    """Read-only in the kernel; SI units."""

    board: Array  # (3, 3) board from carriage
    gravity: Array  # (3,) specific force at rest, rail frame
    earth: Array  # (3,) rail frame
    field: Array  # (3,) rail frame, T
    tilt: Array  # (3, tilt drivers)
    field_terms: Array  # (3, 2): T/m, T/A
    terms: Array  # (3, 3, drivers)
    gyro_matrix: Array  # (3, 3, 3)
    accel_matrix: Array  # (2, 3, 3)
    accel_bias: Array  # (2, 3)
    mag_matrix: Array  # (3, 3)
    hard_iron: Array  # (3,)
    white: Array  # (13,) per step
    flicker_keep: Array  # (5,)
    flicker_drive: Array  # (3, 5)
    walk: Array  # (3,) per step
    mag_noise: float
    thermal: Array  # (8,): ambient, rise, gain, wander, lag gain, BNO offset, noise, reference
    supply: Array  # (5,): regulator, converter noise, cell, discharge per step, full cell
    tone: Array  # (2,): angular frequency, phase
    jump_time: float
    sway: Array  # (5,): b0 b1 b2 a1 a2
    tooth: Array  # (2,): radians per metre, phase
    play: float
    rattle: Array  # (2,): kept a step, driven a step
    filters: Array  # (5, 5): b0 b1 b2 a1 a2
    delay: Array  # (13, 2): whole steps, and the rest of 0 or 0.2 to 1.2 steps
    hold_step: Array  # (4,): samples per step
    scale: Array  # (5,): MPU gyro, MPU accel, BNO gyro, BNO accel, BNO mag: LSB per SI unit
    limit: Array  # (4,): MPU gyro, MPU accel, BNO gyro, BNO accel: LSB
    coarse: Array  # (2,): LSB between two values of the MPU's gyro, the BNO's
    asleep: bool
    fuses: bool


class State(NamedTuple):
    """Changed in place by the kernel."""

    steps: IntArray  # (2,): steps done, index in the ring
    thermal: Array  # (3,): heating, wander, lagged temperature
    previous: Array  # (5,): last step's specific force on the board, acceleration and position of the carriage
    flicker: Array  # (7, 5)
    walk: Array  # (7,)
    ring: Array  # (13, RING)
    allpass: Array  # (13, 2)
    biquad: Array  # (13, 2)
    filtered: Array  # (13,)
    phase: Array  # (4,)
    held: IntArray  # (7 + 9,): MPU registers; BNO accel, mag, gyro registers
    held_time: Array  # (1,): of the BNO's gyro sample, s
    drivers: Array  # (drivers,) scratch
    sway: Array  # (2,)
    play: Array  # (1,): -1 to 1
    rattle: Array  # (3,)
    truth: Array  # (5, 3) scratch: rate, force, field on the board, dynamic acceleration of the carriage; tilt


def fresh_state() -> State:
    """The state at switching on; the first step fills the filters with its own values."""
    return State(
        steps=np.zeros(2, dtype=np.int64),
        thermal=np.zeros(3),
        previous=np.zeros(5),
        flicker=np.zeros((GYROS, FLICKERS)),
        walk=np.zeros(GYROS),
        ring=np.zeros((CHANNELS, RING)),
        allpass=np.zeros((CHANNELS, 2)),
        biquad=np.zeros((CHANNELS, 2)),
        filtered=np.zeros(CHANNELS),
        phase=np.ones(HOLDS),
        held=np.zeros(16, dtype=np.int64),
        held_time=np.zeros(1),
        drivers=np.zeros(len(GyroDriver)),
        sway=np.zeros(2),
        play=np.zeros(1),
        rattle=np.zeros(3),
        truth=np.zeros((5, 3)),
    )


class Registers(NamedTuple):
    """What the chips hold after each step; n is the number of steps."""

    time: Array  # (n,) s
    mpu: npt.NDArray[np.int16]  # (n, 7): registers 0x3B to 0x48
    bno: npt.NDArray[np.int16]  # (n, 22): page 0, registers 0x08 to 0x33
    bno_temperature: npt.NDArray[np.int8]  # (n,): register 0x34
    bno_time: Array  # (n,) s: of the BNO's newest gyro sample
    lisy: npt.NDArray[np.uint16]  # (n, 16) conversions
    battery: npt.NDArray[np.uint16]  # (n,) mV
