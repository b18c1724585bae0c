"""Position controllers: the thesis's PI, and model feed-forward with state feedback.

Both take a reference (position, velocity, acceleration) and the measured state and give a motor voltage. Both limit it
so that the current stays within the drive's, and neither integrates while limited.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

from gsense_rig.control.model import DriveModel

if TYPE_CHECKING:
    from gsense_rig.control.references import Setpoint
    from gsense_rig.plant.parameters import DriveParameters


@dataclass(frozen=True)
class ControlLimits:
    """What the controller may ask of the drive."""

    voltage: float = 23.0  # V; a little below the supply, so that a PWM edge remains
    current: float = 5.0  # A; 8 rad/s at 0.15 m takes 2.5 A


class Measured(NamedTuple):
    """The carriage's state as known."""

    encoder: float  # m, as read
    position: float  # m, observer
    velocity: float  # m/s, observer


class Controller(Protocol):
    """Turns reference and measurement into a voltage, once a period."""

    def reset(self) -> None:
        """Forget the integral."""

    def voltage(self, setpoint: Setpoint, measured: Measured, period: float) -> float:
        """Motor voltage [V] for a measured state; period [s]."""


@dataclass(frozen=True)
class PIGains:
    """Gains of the thesis's PI position control (section 6.3; its numbers are not given)."""

    proportional: float = 800.0  # V/m
    integral: float = 1500.0  # V/(m·s)


@dataclass(frozen=True)
class FeedforwardGains:
    """Gains beside the feed-forward: all closed-loop poles at -pole (rigid model with time constant R m / c²)."""

    pole: float = 60.0  # rad/s: below 0.5 mm at 8 rad/s with a model that is 20 % off


TUNED_GAINS = FeedforwardGains(pole=30.0)  # with an identified model; the encoder's steps then hardly shake the board


class _Limiter:
    def __init__(self, drive: DriveParameters, limits: ControlLimits) -> None:
        self._c = drive.force_constant
        self._room = drive.resistance * limits.current
        self._voltage = limits.voltage

    def clip(self, voltage: float, velocity: float) -> float:
        emf = self._c * velocity
        high = min(self._voltage, emf + self._room)
        low = max(-self._voltage, emf - self._room)
        return min(max(voltage, low), high)


class PIController:
    """u = Kp e + Ki ∫ e dt on position, as in the thesis, section 6.3."""

    def __init__(
        self, drive: DriveParameters, gains: PIGains | None = None, limits: ControlLimits | None = None
    ) -> None:
        self.gains = gains or PIGains()
        self._limiter = _Limiter(drive, limits or ControlLimits())
        self._integral = 0.0  # m·s

    def reset(self) -> None:
        """Forget the integral."""
        self._integral = 0.0

    def voltage(self, setpoint: Setpoint, measured: Measured, period: float) -> float:
        """Motor voltage [V]."""
        error = setpoint.position - measured.encoder
        integral = self._integral + error * period
        wanted = self.gains.proportional * error + self.gains.integral * integral
        limited = self._limiter.clip(wanted, measured.velocity)
        if limited == wanted or error * (wanted - limited) < 0.0:
            self._integral = integral
        return limited


class FeedforwardController:
    """Voltage of the inverse model for the reference, plus state feedback with integral on what remains."""

    def __init__(
        self, drive: DriveParameters, gains: FeedforwardGains | None = None, limits: ControlLimits | None = None
    ) -> None:
        self.model = DriveModel(drive)
        self.gains = gains or FeedforwardGains()
        self._limiter = _Limiter(drive, limits or ControlLimits())
        inertia, pole = self.model.inertia, self.gains.pole
        # Characteristic polynomial  inertia s³ + (c + kd) s² + kp s + ki = inertia (s + pole)³
        self._kd = 3.0 * pole * inertia - drive.force_constant
        self._kp = 3.0 * pole**2 * inertia
        self._ki = pole**3 * inertia
        self._integral = 0.0  # m·s

    def reset(self) -> None:
        """Forget the integral."""
        self._integral = 0.0

    def voltage(self, setpoint: Setpoint, measured: Measured, period: float) -> float:
        """Motor voltage [V]."""
        error = setpoint.position - measured.encoder
        integral = self._integral + error * period
        # The voltage holds for a period: what it needs in the middle of it.
        ahead = setpoint.velocity + 0.5 * period * setpoint.acceleration
        wanted = (
            self.model.voltage(ahead, setpoint.acceleration)
            + self._kp * (setpoint.position - measured.position)  # the encoder's steps would shake the carriage
            + self._kd * (setpoint.velocity - measured.velocity)
            + self._ki * integral
        )
        limited = self._limiter.clip(wanted, measured.velocity)
        if limited == wanted or error * (wanted - limited) < 0.0:
            self._integral = integral
        return limited


CONTROLLERS = ("feedforward", "pi")


def make_controller(name: str, drive: DriveParameters, tuned: bool = False) -> Controller:
    """Make a controller by its name; tuned: the drive's numbers were identified.

    Raises:
        ValueError: no such controller.
    """
    if name == "pi":
        return PIController(drive)
    if name == "feedforward":
        return FeedforwardController(drive, TUNED_GAINS if tuned else None)
    raise ValueError(f"controller '{name}' is unknown; choose one of {', '.join(CONTROLLERS)}")
