"""What goes into the loop (commands) and comes out of it (telemetry, replies, results)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from gsense_rig.plant.parameters import DriveParameters


@dataclass(frozen=True)
class Home:
    """Find the zero."""

    id: int


@dataclass(frozen=True)
class Stop:
    """Come to rest softly; the motor is then off."""

    id: int


@dataclass(frozen=True)
class Reset:
    """Leave FAULT."""

    id: int


@dataclass(frozen=True)
class DriveSine:
    """Drive amplitude * sin(angular_frequency * t), whole cycles at full amplitude between smooth ramps."""

    id: int
    amplitude: float  # m
    angular_frequency: float  # rad/s
    cycles: int


class Shape(IntEnum):
    """Shapes of a DriveMove; the numbers are those of gsense_msgs/Move."""

    HOLD = 0
    STEP = 1
    TRIANGLE = 2


@dataclass(frozen=True)
class DriveMove:
    """Go to a position and hold it there; as a step at the drive's limits; or drive a triangle about it."""

    id: int
    shape: int  # a Shape
    position: float  # m
    amplitude: float = 0.0  # m, triangle
    angular_frequency: float = 0.0  # rad/s, triangle
    duration: float = 0.0  # s held at the position; of the triangle, in whole periods at least as long


@dataclass(frozen=True)
class Park:
    """Go where the board is turned or changed; the motor is then off."""

    id: int


@dataclass(frozen=True)
class Tune:
    """Make the move from which the drive is identified; the result has its record."""

    id: int


@dataclass(frozen=True)
class UseModel:
    """Believe an identified drive from now on; at rest alone."""

    id: int
    drive: DriveParameters


Command = Home | Stop | Reset | DriveSine | DriveMove | Park | Tune | UseModel


class Reply(NamedTuple):
    """Immediate answer to a command; an accepted one gets a Result when it is done."""

    id: int
    accepted: bool
    message: str


class Result(NamedTuple):
    """End of an accepted command."""

    id: int
    success: bool
    message: str
    rms_error: float = 0.0  # m, tracking error over the part of a motion that counts (a sine at full amplitude)
    record: NDArray[np.float64] | None = None  # of a tune move, shape (n, 3): see control.tuning.identify


class Telemetry(NamedTuple):
    """State of the loop after one tick."""

    time: float  # s, the loop's clock, of the encoder's read
    homed: bool
    position: float  # m, encoder, quantised; on the encoder's power-on zero while not homed
    velocity: float  # m/s, observer
    acceleration: float  # m/s², observer
    force: float  # N, drive's force on the belt from the motor's current
    reference: float  # m; the position where nothing is controlled
    tracking_error: float  # m; reference - position, 0 where nothing is controlled
    duty: float  # -1..1
    disabled: bool
    current: float  # A
    switches: tuple[bool, bool, bool, bool]
    light: int
    mode: int
    fault: int
    fault_text: str
    command: int  # id of the command in work, 0: none
    elapsed: float  # s since that command's motion began
