"""The stop: a short-circuit brake (PWM 0, bridge on) whose current is limited, until standstill; then DIS.

At 1.2 m/s the motor's own voltage is 14 V: short-circuited it would drive 11.7 A through the bridge. While it exceeds
what the allowed current drops in the winding, the bridge is given the difference as PWM in the sense of the motion.
The motor then still brakes, with the allowed current. Below 0.5 m/s the PWM is 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class BrakeParameters:
    """How a brake acts, and when it is over."""

    current: float = 5.0  # A; brakes with some 30 m/s²
    standstill_speed: float = 0.01  # m/s
    standstill_time: float = 0.03  # s below that speed
    blind_time: float = 0.3  # s where the speed is not known; 1.2 m/s take 0.1 s
    longest: float = 1.0  # s; then the bridge goes off whatever the encoder says
    fastest: float = 1.7  # m/s; no brake begins above it
    slowest_decay: float = 20.0  # m/s²: the speed falls faster than this, so a PWM that allows for more is wrong


class Brake:
    """One brake at a time; `active` from `begin` until `update` says that it is over."""

    def __init__(self, parameters: BrakeParameters) -> None:
        self.parameters = parameters
        self._since: float | None = None
        self._still_since: float | None = None

    @property
    def active(self) -> bool:
        """Whether the brake is on."""
        return self._since is not None

    def begin(self, now: float) -> None:
        """Start, unless it is on already."""
        if self._since is None:
            self._since, self._still_since = now, None

    def release(self) -> None:
        """End it."""
        self._since = None

    def update(self, now: float, velocity: float, blind: bool = False) -> bool:
        """Whether to go on braking at a time [s] and velocity [m/s]; blind: the velocity cannot be trusted."""
        if self._since is None:
            return False
        p = self.parameters
        if abs(velocity) > p.standstill_speed:
            self._still_since = None
        elif self._still_since is None:
            self._still_since = now
        still = self._still_since is not None and now - self._still_since >= p.standstill_time
        over = now - self._since >= p.blind_time if blind else still
        if over or now - self._since >= p.longest:
            self._since = None
        return self.active

    def voltage(self, now: float, speeds: tuple[float, ...], constant: float, resistance: float) -> float:
        """Voltage [V] that keeps the braking current within its limit.

        It can only err towards a harder brake: the slowest of the speeds counts, none where their signs differ, and
        none that a carriage under the brake can no longer have.

        Args:
            now: time [s].
            speeds: what the speed is by each witness that is trusted [m/s]; none: full short circuit.
            constant: back EMF per speed [V·s/m].
            resistance: of the winding [ohm].
        """
        if self._since is None or not speeds or min(speeds) * max(speeds) <= 0.0:
            return 0.0
        p = self.parameters
        possible = p.fastest - p.slowest_decay * (now - self._since)
        speed = min(*(abs(v) for v in speeds), possible)
        return math.copysign(max(constant * speed - resistance * p.current, 0.0), speeds[0])
