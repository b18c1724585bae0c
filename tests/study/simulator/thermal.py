"""Temperatures of ambient, board, die and the gyro's mechanical element over a session, as an RC network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .parameters import ThermalParameters

Array = NDArray[np.float64]
STEP_S = 0.25


@dataclass(frozen=True)
class Temperatures:
    """degrees Celsius over session time, each shape (n,)."""

    time: Array
    die: Array
    element: Array

    def die_at(self, time: Array) -> Array:
        return np.interp(time, self.time, self.die)

    def element_at(self, time: Array) -> Array:
        return np.interp(time, self.time, self.element)


def warm_up(p: ThermalParameters, duration_s: float, rng: np.random.Generator) -> Temperatures:
    """From switching on, `warm_for_s` before the session's start, to its end."""
    time = np.arange(-p.warm_for_s, duration_s + 10.0, STEP_S)
    phase = rng.uniform(0, 2 * np.pi)
    ambient = p.ambient_degc + p.ambient_swing_k * np.sin(2 * np.pi * time / p.ambient_period_s + phase)
    board = die = element = float(ambient[0])
    out = np.zeros((len(time), 2))
    for i, room in enumerate(ambient):
        board += STEP_S * (room + p.board_rise_k - board) / p.board_tau_s
        die += STEP_S * (board + p.die_rise_k - die) / p.die_tau_s
        element += STEP_S * (die - element) / p.element_tau_s
        out[i] = die, element
    return Temperatures(time, out[:, 0], out[:, 1])


def thermometer(p: ThermalParameters, temperatures: Temperatures, time: Array, rng: np.random.Generator) -> Array:
    """What the die's thermometer reports."""
    reading = temperatures.die_at(time) + p.thermometer_noise_k * rng.standard_normal(len(time))
    return np.round(reading / p.thermometer_lsb_k) * p.thermometer_lsb_k
