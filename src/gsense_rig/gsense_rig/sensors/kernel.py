"""The physics, one step of 1 ms after the other: from the carriage's motion to the chips' registers.

One implementation for the live rig (a few steps a call) and for simulated campaigns (a run a call). The random numbers
are passed in, a row a step, so that the result does not depend on how a history is divided into calls.
"""

# ruff: noqa: RUF046
from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from gsense_rig.sensors.constants import STEP
from gsense_rig.sensors.kernel_motion import FIELD, FORCE, RATE, STILL, inner, true_motion
from gsense_rig.sensors.layout import (
    ACCELS,
    CHANNELS,
    FILTER_OF,
    FLICKERS,
    GYRO_AXIS,
    GYRO_CHIP,
    GYROS,
    NOISE_ADC,
    NOISE_FLICKER,
    NOISE_MAG,
    NOISE_RATTLE,
    NOISE_THERMAL,
    NOISE_WALK,
    NOISE_WHITE,
    RING,
    Array,
    Registers,
    Settings,
    State,
)

INT16_MAX = 32767


@inner
def _sway(pushed: float, cfg: Settings, state: State) -> float:
    """The board on its elastic mount (transposed direct form II)."""
    b0, b1, b2, a1, a2 = cfg.sway
    z = state.sway
    y = b0 * pushed + z[0]
    z[0] = b1 * pushed - a1 * y + z[1]
    z[1] = b2 * pushed - a2 * y
    return float(y)


@inner
def _temperature(cfg: Settings, state: State, noise: Array) -> float:
    """Advances warm-up, wander and lag; returns the die temperature."""
    th, x = cfg.thermal, state.thermal
    if state.steps[0] == 0:
        x[2] = th[0]
    x[0] += (th[1] - x[0]) * th[2]
    x[1] += th[3] * noise[NOISE_THERMAL]
    die = th[0] + x[0] + x[1]
    x[2] += (die - x[2]) * th[4]
    return die


@inner
def _drivers(sample: Array, cfg: Settings, state: State, noise: Array) -> None:
    """Fills the drivers of `drivers.GyroDriver`."""
    d, force = state.drivers, state.truth[FORCE]
    elapsed = state.steps[0] * STEP
    v, a = sample[2], sample[3]
    d[0] = 1.0
    for i in range(3):
        d[1 + i] = force[i]
        d[8 + i] = (force[i] - state.previous[i]) / STEP if state.steps[0] > 0 else 0.0
        state.previous[i] = force[i]
    d[4] = state.thermal[2] - cfg.thermal[7]
    d[5] = a * a
    d[6] = v
    d[7] = math.tanh(v / STILL)
    d[11] = math.sin(cfg.tone[0] * elapsed + cfg.tone[1]) if sample[4] != 0.0 else 0.0
    d[12] = 1.0 if elapsed >= cfg.jump_time else 0.0
    d[13] = 0.0
    pushed = 0.0
    for i in range(3):
        along = cfg.board[i, 0] * a
        d[13] += along**3
        pushed += along
    d[14] = _sway(pushed, cfg, state)
    d[15] = cfg.supply[2] - cfg.supply[3] * state.steps[0] - cfg.supply[4]
    for i in range(3):
        if noise.size > NOISE_RATTLE:
            state.rattle[i] = cfg.rattle[0] * state.rattle[i] + cfg.rattle[1] * noise[NOISE_RATTLE + i]
        d[16 + i] = state.rattle[i] * v


@inner
def _slow_noise(ch: int, chip: int, cfg: Settings, state: State, noise: Array) -> float:
    """Flicker and rate random walk of a gyro channel."""
    state.walk[ch] += cfg.walk[chip] * noise[NOISE_WALK + ch]
    total = state.walk[ch]
    for p in range(FLICKERS):
        draw = noise[NOISE_FLICKER + ch * FLICKERS + p]
        state.flicker[ch, p] = cfg.flicker_keep[p] * state.flicker[ch, p] + cfg.flicker_drive[chip, p] * draw
        total += state.flicker[ch, p]
    return total


@inner
def _elements(cfg: Settings, state: State, noise: Array) -> None:
    """What each sensing element delivers, without white noise, into the delay line."""
    at = state.steps[1]
    for ch in range(GYROS):
        chip, axis = GYRO_CHIP[ch], GYRO_AXIS[ch]
        value = _slow_noise(ch, chip, cfg, state, noise)
        for j in range(3):
            value += cfg.gyro_matrix[chip, axis, j] * state.truth[RATE, j]
        for j in range(state.drivers.size):
            value += cfg.terms[chip, axis, j] * state.drivers[j]
        state.ring[ch, at] = value
    for ch in range(ACCELS):
        chip, axis = ch // 3, ch % 3
        value = cfg.accel_bias[chip, axis]
        for j in range(3):
            value += cfg.accel_matrix[chip, axis, j] * state.truth[FORCE, j]
        state.ring[GYROS + ch, at] = value
    if state.steps[0] == 0:
        for ch in range(CHANNELS):
            state.ring[ch, :] = state.ring[ch, at]


@inner
def _delayed(ch: int, at: int, cfg: Settings, state: State) -> float:
    """Whole steps by the delay line, the rest by a first-order all-pass (Thiran), which attenuates nothing."""
    whole = int(cfg.delay[ch, 0])
    part = cfg.delay[ch, 1]
    x = state.ring[ch, (at - whole) % RING]
    if part == 0.0:
        return x
    a = (1.0 - part) / (1.0 + part)
    previous = state.allpass[ch]
    if state.steps[0] == 0:
        previous[0] = previous[1] = x
    y = a * x + previous[0] - a * previous[1]
    previous[0] = x
    previous[1] = y
    return y


@inner
def _filter(cfg: Settings, state: State, noise: Array) -> None:
    """Delay, white noise, low-pass (transposed direct form II)."""
    at = state.steps[1]
    for ch in range(CHANNELS):
        x = _delayed(ch, at, cfg, state)
        b0, b1, b2, a1, a2 = cfg.filters[FILTER_OF[ch]]
        z = state.biquad[ch]
        if state.steps[0] == 0:  # settled on the first value
            z[0] = x * (1.0 - b0)
            z[1] = x * (b2 - a2)
        x += cfg.white[ch] * noise[NOISE_WHITE + ch]
        y = b0 * x + z[0]
        z[0] = b1 * x - a1 * y + z[1]
        z[1] = b2 * x - a2 * y
        state.filtered[ch] = y


@inner
def _register(value: float, scale: float, limit: float, coarse: float = 1.0) -> int:
    """Quantised and clipped."""
    return int(min(limit, max(-limit - 1.0, coarse * np.rint(value * scale / coarse))))


@inner
def _due(cfg: Settings, state: State) -> npt.NDArray[np.bool_]:
    """Which of the sample-and-hold clocks tick in this step; the first step makes all of them tick."""
    due = np.empty(4, dtype=np.bool_)
    for h in range(4):
        state.phase[h] = 1.0 if state.steps[0] == 0 else state.phase[h] + cfg.hold_step[h]
        due[h] = state.phase[h] >= 1.0 - 1e-6
        if due[h]:
            state.phase[h] -= 1.0
    return due


@inner
def _hold(time: float, die: float, cfg: Settings, state: State, noise: Array) -> None:
    """Sample-and-hold at each chip's own rate."""
    due = _due(cfg, state)
    held, y = state.held, state.filtered
    if due[0] and not cfg.asleep:
        for i in range(3):
            held[i] = _register(y[GYROS + i], cfg.scale[1], cfg.limit[1])
            held[4 + i] = _register(y[i], cfg.scale[0], cfg.limit[0], cfg.coarse[0])
        warmth = die + cfg.thermal[6] * noise[NOISE_THERMAL + 1]
        held[3] = _register(warmth - 36.53, 340.0, 32767.0)
    for i in range(3):
        if due[2]:
            held[7 + i] = _register(y[GYROS + 3 + i], cfg.scale[3], cfg.limit[3])
        if due[3]:
            field = cfg.hard_iron[i] + cfg.mag_noise * noise[NOISE_MAG + i]
            for j in range(3):
                field += cfg.mag_matrix[i, j] * state.truth[FIELD, j]
            held[10 + i] = _register(field, cfg.scale[4], 32767.0)
        if due[1]:
            held[13 + i] = _register(y[3 + i], cfg.scale[2], cfg.limit[2], cfg.coarse[1])
    if due[1]:
        state.held_time[0] = time


@inner
def _fusion(B: Array, cfg: Settings, state: State, out: npt.NDArray[np.int16]) -> None:
    """BNO055 fusion registers: Euler (h r p), quaternion (rail from board), linear acceleration, gravity."""
    up = np.array((B[0, 2], B[1, 2], B[2, 2]))
    heading = math.atan2(-B[1, 0], B[0, 0])
    roll = math.atan2(up[1], up[2])
    pitch = -math.asin(min(1.0, max(-1.0, up[0])))
    sixteenth = 16.0 * 180.0 / math.pi
    out[9] = int(round((heading % (2.0 * math.pi)) * sixteenth))
    out[10] = int(round(roll * sixteenth))
    out[11] = int(round(pitch * sixteenth))
    w = math.sqrt(max(0.0, 1.0 + B[0, 0] + B[1, 1] + B[2, 2])) / 2.0
    x = math.copysign(math.sqrt(max(0.0, 1.0 + B[0, 0] - B[1, 1] - B[2, 2])) / 2.0, B[1, 2] - B[2, 1])
    y = math.copysign(math.sqrt(max(0.0, 1.0 - B[0, 0] + B[1, 1] - B[2, 2])) / 2.0, B[2, 0] - B[0, 2])
    z = math.copysign(math.sqrt(max(0.0, 1.0 - B[0, 0] - B[1, 1] + B[2, 2])) / 2.0, B[0, 1] - B[1, 0])
    for i, q in enumerate((w, x, y, z)):
        out[12 + i] = int(round(q * 16384.0))
    for i in range(3):
        gravity = up[i] * cfg.gravity[2]
        out[16 + i] = _register(state.filtered[GYROS + 3 + i] - gravity, cfg.scale[3], 32767.0)
        out[19 + i] = _register(gravity, cfg.scale[3], 32767.0)


@inner
def _analog(
    k: int, cfg: Settings, state: State, noise: Array, lisy: npt.NDArray[np.uint16], battery: npt.NDArray[np.uint16]
) -> None:
    """LISY300: absolute output against the converter's reference, 16 conversions; the cell's voltage."""
    rate = state.filtered[6] * 180.0 / math.pi
    volts = 1.65 + 0.0033 * min(300.0, max(-300.0, rate))
    for i in range(16):
        code = volts / cfg.supply[0] * 1024.0 + cfg.supply[1] * noise[NOISE_ADC + i]
        lisy[k, i] = int(min(1023.0, max(0.0, math.floor(code))))
    cell = cfg.supply[2] - cfg.supply[3] * state.steps[0]
    battery[k] = int(min(65535.0, max(0.0, 1000.0 * cell + 4.0 * noise[NOISE_ADC + 16])))


@njit(cache=True)
def advance(history: Array, noise: Array, cfg: Settings, state: State, out: Registers) -> None:
    """Advances the unit by the n steps of `history` (n, 5: t, position, velocity, acceleration, motor current).

    `noise` is (n, NOISE_COLUMNS), standard normal, with RATTLE_COLUMNS more where something rattles; `out`
    receives n rows.
    """
    B = np.empty((3, 3))
    for k in range(history.shape[0]):
        time = history[k, 0]
        true_motion(history[k], cfg, state, B)
        die = _temperature(cfg, state, noise[k])
        _drivers(history[k], cfg, state, noise[k])
        _elements(cfg, state, noise[k])
        _filter(cfg, state, noise[k])
        _hold(time, die, cfg, state, noise[k])
        out.time[k] = time
        for i in range(7):
            out.mpu[k, i] = state.held[i]
        for i in range(9):
            out.bno[k, i] = state.held[7 + i]
        if cfg.fuses:
            _fusion(B, cfg, state, out.bno[k])
        else:
            out.bno[k, 9:] = 0
        out.bno_temperature[k] = int(min(127.0, round(die + cfg.thermal[5])))
        out.bno_time[k] = state.held_time[0]
        _analog(k, cfg, state, noise[k], out.lisy, out.battery)
        state.steps[0] += 1
        state.steps[1] = (state.steps[1] + 1) % RING
