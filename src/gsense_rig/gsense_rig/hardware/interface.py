"""What the control loop sees of the rail, whatever is behind it.

Thesis, section 6.3: an encoder, three inductive switches and an optical one come in; DIR, DIS and PWM of the motor's
bridge and a traffic light go out.
"""

from __future__ import annotations

from typing import NamedTuple, Protocol


class HardwareError(RuntimeError):
    """The rail's hardware is missing or failed; the message is one line that says what to do."""


class HardwareReading(NamedTuple):
    """Inputs read in one go."""

    counts: int  # encoder, zero wherever it was at power-on; up to the right
    switches: tuple[bool, bool, bool, bool]  # left, centre, right, optical; true: sees the carriage
    current: float  # A, motor, positive pushes to the right
    bridge_ok: bool = True  # false: the bridge reports a fault
    emergency_stop: bool = False  # true: the motor's supply is cut by hand


class MotorOutput(NamedTuple):
    """Outputs written in one go."""

    duty: float  # -1..1: sign is DIR, size is PWM; 0 with the bridge on is a short-circuit brake
    disabled: bool  # DIS: all switches of the bridge open, the carriage coasts
    light: int  # traffic light, see safety.modes.Light


MOTOR_OFF = MotorOutput(duty=0.0, disabled=True, light=0)


class GuardedRail(Protocol):
    """The rail as the guard process has it: a handle of its own, beside the loop's."""

    counts_per_metre: float

    def now(self) -> float:
        """Time of the rail's clock [s]: that of the loop's heartbeat."""

    def read_counts(self) -> int:
        """Encoder alone: disturbs nobody.

        Raises:
            HardwareError: the hardware does not answer.
        """

    def read(self) -> HardwareReading:
        """Read all inputs; only when the loop does so no more.

        Raises:
            HardwareError: the hardware does not answer.
        """

    def write(self, output: MotorOutput) -> None:
        """Write all outputs, from whatever state they are in.

        Raises:
            HardwareError: the hardware does not answer.
        """

    def close(self) -> None:
        """Let go of the hardware; changes no output."""


class RailHardware(Protocol):
    """The rail. An implementation changes DIR only while PWM is 0, and starts with the bridge disabled."""

    counts_per_metre: float

    def read(self) -> HardwareReading:
        """Read all inputs.

        Raises:
            HardwareError: the hardware does not answer.
        """

    def write(self, output: MotorOutput) -> None:
        """Write all outputs.

        Raises:
            HardwareError: the hardware does not answer.
        """

    def close(self) -> None:
        """Disable the motor and let go of the hardware."""
