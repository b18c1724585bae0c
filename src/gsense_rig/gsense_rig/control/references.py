"""References: where the carriage should be, and how fast, at each time.

Each is a pure function of the time since its start, with velocity and acceleration exact, so that the feed-forward
needs no differences. `Sine` is s = A sin(w t) (thesis, eq. 7.1 to 7.3; the thesis's 7.2 lacks the amplitude) under an
envelope that starts and ends at rest in the centre.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol


class Setpoint(NamedTuple):
    """Wanted motion at one time."""

    position: float  # m
    velocity: float  # m/s
    acceleration: float  # m/s²


class Reference(Protocol):
    """A motion over a finite time (duration may be infinite)."""

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""

    def at(self, elapsed: float) -> Setpoint:
        """Setpoint at a time since the start [s]."""


def smooth_step(u: float) -> tuple[float, float, float]:
    """Quintic from 0 to 1 over u in 0..1 with zero slope and curvature at both ends; value and two derivatives."""
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u >= 1.0:
        return 1.0, 0.0, 0.0
    u2 = u * u
    return (
        u2 * u * (10.0 + u * (-15.0 + 6.0 * u)),
        30.0 * u2 * (1.0 + u * (u - 2.0)),
        60.0 * u * (1.0 + u * (2.0 * u - 3.0)),
    )


@dataclass(frozen=True)
class Hold:
    """Stay at a position."""

    position: float  # m
    duration: float = math.inf  # s

    def at(self, elapsed: float) -> Setpoint:  # noqa: ARG002 - the protocol's signature
        """Setpoint; the same at all times."""
        return Setpoint(self.position, 0.0, 0.0)


@dataclass(frozen=True)
class MoveTo:
    """From rest to rest along a quintic, as fast as the limits allow."""

    start: float  # m
    end: float  # m
    max_velocity: float = 0.4  # m/s
    max_acceleration: float = 3.0  # m/s²

    @cached_property
    def duration(self) -> float:
        """Time the move takes [s]."""
        distance = abs(self.end - self.start)
        # The quintic's peaks: 15/8 of the mean speed, 10/sqrt(3) of distance / duration².
        return max(
            1.875 * distance / self.max_velocity, math.sqrt(10.0 / math.sqrt(3.0) * distance / self.max_acceleration)
        )

    def at(self, elapsed: float) -> Setpoint:
        """Setpoint."""
        total = self.duration
        if total <= 0.0:
            return Setpoint(self.end, 0.0, 0.0)
        s, ds, dds = smooth_step(elapsed / total)
        distance = self.end - self.start
        return Setpoint(self.start + distance * s, distance * ds / total, distance * dds / total**2)


@dataclass(frozen=True)
class Creep:
    """Constant velocity after a ramp; ends only by being replaced (homing)."""

    start: float  # m
    velocity: float  # m/s, signed
    max_acceleration: float = 2.0  # m/s²
    duration: float = math.inf  # s

    def at(self, elapsed: float) -> Setpoint:
        """Setpoint."""
        ramp = abs(self.velocity) / self.max_acceleration
        a = math.copysign(self.max_acceleration, self.velocity)
        if elapsed < ramp:
            return Setpoint(self.start + 0.5 * a * elapsed**2, a * elapsed, a)
        return Setpoint(self.start + self.velocity * (elapsed - 0.5 * ramp), self.velocity, 0.0)


@dataclass(frozen=True)
class Sine:
    """A g(t) sin(w t): g rises smoothly to 1, stays for whole periods, falls smoothly to 0."""

    amplitude: float  # m
    angular_frequency: float  # rad/s
    cycles: int  # whole periods at full amplitude
    max_ramp: float = 2.0  # s; the ramp is one period where that is shorter

    @cached_property
    def ramp(self) -> float:
        """Duration of the ramp at either end [s]."""
        return min(2.0 * math.pi / self.angular_frequency, self.max_ramp)

    @cached_property
    def steady(self) -> float:
        """Duration at full amplitude [s]."""
        return self.cycles * 2.0 * math.pi / self.angular_frequency

    @cached_property
    def duration(self) -> float:
        """Duration of the whole motion [s]."""
        return self.steady + 2.0 * self.ramp

    def is_steady(self, elapsed: float) -> bool:
        """Whether the amplitude is full at a time [s]."""
        return self.ramp <= elapsed <= self.ramp + self.steady

    def at(self, elapsed: float) -> Setpoint:
        """Setpoint; at rest in the centre after the end."""
        if elapsed <= 0.0 or elapsed >= self.duration:
            return Setpoint(0.0, 0.0, 0.0)
        w, ramp = self.angular_frequency, self.ramp
        sine, cosine = math.sin(w * elapsed), math.cos(w * elapsed)
        s, c = self.amplitude * sine, self.amplitude * w * cosine
        if self.is_steady(elapsed):
            return Setpoint(s, c, -w * w * s)
        if elapsed < ramp:
            g, dg, ddg = smooth_step(elapsed / ramp)
            dg, ddg = dg / ramp, ddg / ramp**2
        else:
            g, dg, ddg = smooth_step((self.duration - elapsed) / ramp)
            dg, ddg = -dg / ramp, ddg / ramp**2
        return Setpoint(g * s, dg * s + g * c, ddg * s + 2.0 * dg * c - g * w * w * s)


@dataclass(frozen=True)
class SoftStop:
    """From any motion to rest: the velocity falls at a limited rate, the acceleration at a limited jerk."""

    start: Setpoint
    max_deceleration: float = 10.0  # m/s²; a sine of 0.15 m at 8 rad/s then ends inside its own stroke
    lead: float = 0.02  # s over which the deceleration sets in and ends

    @cached_property
    def duration(self) -> float:
        """Time until rest [s]."""
        return abs(self.start.velocity) / self.max_deceleration + self.lead

    @property
    def end(self) -> float:
        """Where it ends [m]."""
        return self.at(self.duration).position

    def at(self, elapsed: float) -> Setpoint:
        """Setpoint: trapezoid of deceleration of length |v|/a_max + lead with flanks of `lead`."""
        x, v, _ = self.start
        sign = math.copysign(1.0, v) if v else 0.0
        total, lead = self.duration, self.lead
        if total < 2.0 * lead:  # slow already: a symmetric triangle with the same change of velocity
            lead = 0.5 * total
        peak = abs(v) / (total - lead) if total > lead else 0.0
        t = min(max(elapsed, 0.0), total)
        dv, dx, a = _trapezoid(t, total, lead, peak)
        return Setpoint(x + v * t - sign * dx, v - sign * dv, -sign * a if elapsed < total else 0.0)


def _trapezoid(t: float, total: float, lead: float, peak: float) -> tuple[float, float, float]:
    """First and second integral from 0 to t of a trapezoid pulse, and its value."""
    jerk = peak / lead
    first = min(t, lead)
    v = 0.5 * jerk * first**2
    x = jerk * first**3 / 6.0
    if t <= lead:
        return v, x, jerk * t
    flat = min(t, total - lead) - lead
    x += v * flat + 0.5 * peak * flat**2
    v += peak * flat
    if t <= total - lead:
        return v, x, peak
    last = t - (total - lead)
    x += v * last + 0.5 * peak * last**2 - jerk * last**3 / 6.0
    v += peak * last - 0.5 * jerk * last**2
    return v, x, peak - jerk * last
