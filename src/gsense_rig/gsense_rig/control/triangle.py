"""A triangle wave with parabolic corners: constant speed up and down, acceleration only in the corners."""

from __future__ import annotations

import math
from dataclasses import dataclass

from gsense_rig.control.references import Setpoint

CORNER_ACCELERATION = 10.0
"""m/s^2 in the corners."""


def triangle_is_possible(amplitude: float, angular_frequency: float) -> bool:
    """Whether the corners' acceleration suffices to turn round in the period."""
    half = math.pi / angular_frequency
    return half * half >= 8.0 * amplitude / CORNER_ACCELERATION


@dataclass(frozen=True)
class Triangle:
    """Whole periods about a centre, from rest at -amplitude to rest at -amplitude; turns exactly at +-amplitude."""

    amplitude: float  # m
    angular_frequency: float  # rad/s
    cycles: int
    centre: float = 0.0  # m

    def __post_init__(self) -> None:
        if not triangle_is_possible(self.amplitude, self.angular_frequency):
            raise ValueError(f"a triangle of {self.amplitude} m is too fast at {self.angular_frequency} rad/s")

    @property
    def half(self) -> float:
        """Half a period, s."""
        return math.pi / self.angular_frequency

    @property
    def duration(self) -> float:
        """Seconds of the whole motion."""
        return 2.0 * self.half * self.cycles

    @property
    def speed(self) -> float:
        """m/s between the corners: V (half - V / a) = 2 amplitude."""
        a = CORNER_ACCELERATION
        return 0.5 * a * (self.half - math.sqrt(self.half**2 - 8.0 * self.amplitude / a))

    def at(self, elapsed: float) -> Setpoint:
        """Setpoint; at rest at -amplitude before and after."""
        if elapsed <= 0.0 or elapsed >= self.duration:
            return Setpoint(self.centre - self.amplitude, 0.0, 0.0)
        index, t = divmod(elapsed, self.half)
        sign = 1.0 if int(index) % 2 == 0 else -1.0
        a, v = CORNER_ACCELERATION, self.speed
        corner = v / a
        if t < corner:
            travelled, speed, push = 0.5 * a * t * t, a * t, a
        elif t <= self.half - corner:
            travelled, speed, push = v * (t - 0.5 * corner), v, 0.0
        else:
            left = self.half - t
            travelled, speed, push = 2.0 * self.amplitude - 0.5 * a * left * left, a * left, -a
        return Setpoint(self.centre + sign * (travelled - self.amplitude), sign * speed, sign * push)
