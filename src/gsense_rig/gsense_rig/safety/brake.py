"""The stop: short-circuit brake (PWM 0, bridge on) until standstill, then DIS."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BrakeParameters:
    """When a brake is over."""

    standstill_speed: float = 0.01  # m/s
    standstill_time: float = 0.03  # s below that speed
    blind_time: float = 0.3  # s where the speed is not known; 1.2 m/s take 0.1 s
    longest: float = 1.0  # s; then the bridge goes off whatever the encoder says


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
