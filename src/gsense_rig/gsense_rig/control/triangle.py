"""A triangle wave with rounded corners: constant speed up and down, acceleration only in the corners.

The corners are parabolas, and the whole is the mean over `SMOOTHING` of that, so that the acceleration sets in and ends
along ramps: its steps would make the belt ring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from gsense_rig.control.references import Setpoint

CORNER_ACCELERATION = 10.0
"""m/s^2 in the corners."""
SMOOTHING = 0.02
"""s; the wave turns CORNER_ACCELERATION * SMOOTHING^2 / 24 = 0.17 mm ahead of its amplitude."""


def triangle_is_possible(amplitude: float, angular_frequency: float) -> bool:
    """Whether the corners' acceleration suffices to turn round in the period."""
    half = math.pi / angular_frequency
    return half * half >= 8.0 * amplitude / CORNER_ACCELERATION


@dataclass(frozen=True)
class Triangle:
    """Whole periods about a centre, from rest at -amplitude to rest at -amplitude."""

    amplitude: float  # m
    angular_frequency: float  # rad/s
    cycles: int
    centre: float = 0.0  # m

    def __post_init__(self) -> None:
        if not triangle_is_possible(self.amplitude, self.angular_frequency):
            raise ValueError(f"a triangle of {self.amplitude} m is too fast at {self.angular_frequency} rad/s")

    @cached_property
    def half(self) -> float:
        """Half a period, s."""
        return math.pi / self.angular_frequency

    @cached_property
    def duration(self) -> float:
        """Seconds of the whole motion."""
        return 2.0 * self.half * self.cycles + SMOOTHING

    @cached_property
    def speed(self) -> float:
        """m/s between the corners: V (half - V / a) = 2 amplitude."""
        a = CORNER_ACCELERATION
        return 0.5 * a * (self.half - math.sqrt(self.half**2 - 8.0 * self.amplitude / a))

    def at(self, elapsed: float) -> Setpoint:
        """Setpoint; at rest at -amplitude before and after."""
        if elapsed <= 0.0 or elapsed >= self.duration:
            return Setpoint(self.centre - self.amplitude, 0.0, 0.0)
        # The mean over the last SMOOTHING: of each derivative, the difference of the one before it.
        new, old = self._parabolic(elapsed), self._parabolic(elapsed - SMOOTHING)
        area, position, velocity = ((n - o) / SMOOTHING for n, o in zip(new, old, strict=True))
        return Setpoint(self.centre + area, position, velocity)

    def _parabolic(self, elapsed: float) -> tuple[float, float, float]:
        """Area under the position since the start [m·s], position [m], velocity [m/s], with parabolic corners."""
        A, end = self.amplitude, 2.0 * self.half * self.cycles
        if elapsed <= 0.0 or elapsed >= end:
            return -A * (elapsed if elapsed <= 0.0 else elapsed - end), -A, 0.0  # the area of whole periods is zero
        index, t = divmod(elapsed, self.half)
        sign = 1.0 if int(index) % 2 == 0 else -1.0
        area, travelled, speed = self._stroke(t)
        return sign * (area - A * t), sign * (travelled - A), sign * speed

    def _stroke(self, t: float) -> tuple[float, float, float]:
        """One stroke from rest to rest: area under what was travelled [m·s], travelled [m], speed [m/s]."""
        a, v, A = CORNER_ACCELERATION, self.speed, self.amplitude
        corner = v / a
        if t < corner:
            return a * t**3 / 6.0, 0.5 * a * t * t, a * t
        if t <= self.half - corner:
            return v * (0.5 * t * t - 0.5 * corner * t + corner**2 / 6.0), v * (t - 0.5 * corner), v
        left = self.half - t
        # From the end back: the whole stroke's area is half its length times its time.
        return A * self.half - 2.0 * A * left + a * left**3 / 6.0, 2.0 * A - 0.5 * a * left * left, a * left
