"""Velocity and acceleration of the carriage from the encoder."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import solve_discrete_are

from gsense_rig.control.model import DriveModel

if TYPE_CHECKING:
    from gsense_rig.plant.parameters import DriveParameters


@dataclass
class DerivativeEstimator:
    """The thesis's way (section 6.3, equations 7.2 and 7.3): derivative, then a first-order low-pass, twice."""

    period: float  # s
    cutoff: float = 30.0  # Hz of each low-pass; lower: less noise, more lag

    def __post_init__(self) -> None:
        self._alpha = 1.0 - math.exp(-2.0 * math.pi * self.cutoff * self.period)
        self._last: float | None = None
        self.velocity = 0.0
        self.acceleration = 0.0

    def reset(self, position: float) -> None:
        """Start at rest at a position [m]."""
        self._last, self.velocity, self.acceleration = position, 0.0, 0.0

    def update(self, position: float) -> None:
        """Take one encoder position [m], a period after the last one."""
        if self._last is None:
            self._last = position
        velocity = self.velocity + self._alpha * ((position - self._last) / self.period - self.velocity)
        raw = (velocity - self.velocity) / self.period
        self.acceleration += self._alpha * (raw - self.acceleration)
        self.velocity, self._last = velocity, position


@dataclass(frozen=True)
class ObserverNoise:
    """What the observer trusts."""

    position: float = 50e-6 / math.sqrt(12.0)  # m, the encoder's step
    velocity: float = 0.01  # (m/s)/sqrt(s): model's error as white acceleration
    disturbance: float = 1.5  # (m/s²)/sqrt(s): drift of the unmodelled acceleration


ACCELERATION_BANDWIDTH = 100.0  # rad/s; more than ten times the fastest drive
TUNED_NOISE = ObserverNoise(velocity=0.003, disturbance=0.5)  # with an identified model


class DriveObserver:
    """Steady-state Kalman filter over position, velocity and unmodelled acceleration, driven by the motor's voltage.

    The prediction is the drive's model, so a velocity needs no low-pass and has no lag. The acceleration is the model's
    behind an alpha-beta filter, which has no lag either where the jerk is constant: the voltage's steps are felt by the
    motor, hardly by the carriage behind the belt.
    """

    def __init__(self, drive: DriveParameters, period: float, noise: ObserverNoise | None = None) -> None:
        self.period = period
        self._model = DriveModel(drive)
        self._gain = _steady_gain(self._model.decay, period, noise or ObserverNoise())
        pole = math.exp(-ACCELERATION_BANDWIDTH * period)
        self._alpha, self._beta = 1.0 - pole**2, (1.0 - pole) ** 2
        self.position = 0.0
        self.velocity = 0.0
        self.acceleration = 0.0
        self._change = 0.0  # m/s² per period
        self._disturbance = 0.0

    def reset(self, position: float) -> None:
        """Start at rest at a position [m]."""
        self.position, self.velocity, self.acceleration = position, 0.0, 0.0
        self._change, self._disturbance = 0.0, 0.0

    def shift(self, offset: float) -> None:
        """Move the zero: positions become smaller by offset [m]."""
        self.position -= offset

    def predict(self, voltage: float | None) -> None:
        """Go on by one period without an encoder, under a voltage [V] (None: bridge open)."""
        h = self.period
        # Midpoint rule: friction turns round within a period, and the mechanical time constant is 19 ms.
        a = self._model.acceleration(self.velocity, voltage) + self._disturbance
        middle = self.velocity + 0.5 * h * a
        a = self._model.acceleration(middle, voltage) + self._disturbance
        self.position += h * middle
        self.velocity += h * a
        self.acceleration += self._change
        surprise = a - self.acceleration
        self.acceleration += self._alpha * surprise
        self._change += self._beta * surprise

    def update(self, position: float, voltage: float | None) -> None:
        """Take one encoder position [m] and the voltage of the period before it (None: bridge open)."""
        self.predict(voltage)
        innovation = position - self.position
        k0, k1, k2 = self._gain
        self.position += k0 * innovation
        self.velocity += k1 * innovation
        self._disturbance += k2 * innovation


@lru_cache(maxsize=8)
def _steady_gain(decay: float, h: float, noise: ObserverNoise) -> tuple[float, float, float]:
    """Gain of the steady Kalman filter of the linearised drive, whose velocity decays at a rate [1/s]."""
    transition = np.array([[1.0, h, 0.5 * h * h], [0.0, math.exp(-decay * h), h], [0.0, 0.0, 1.0]])
    driving = np.diag([1e-18, noise.velocity**2 * h, noise.disturbance**2 * h])
    read = np.array([[1.0], [0.0], [0.0]])
    predicted = solve_discrete_are(transition.T, read, driving, np.array([[noise.position**2]]))
    gain = predicted[:, 0] / (predicted[0, 0] + noise.position**2)
    return float(gain[0]), float(gain[1]), float(gain[2])
