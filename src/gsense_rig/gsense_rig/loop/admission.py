"""Whether a motion may be driven now; asked by the loop, and by the node ahead of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gsense_rig.control.limits import refuse_hold, refuse_sine, refuse_triangle
from gsense_rig.control.model import DriveModel
from gsense_rig.loop.messages import DriveMove, DriveSine, Park, Shape
from gsense_rig.safety.modes import Mode

if TYPE_CHECKING:
    from gsense_rig.loop.messages import Tune
    from gsense_rig.loop.parameters import LoopParameters


def busy_text(mode: Mode, fault_text: str) -> str:
    """Why a mode takes no motion."""
    if mode is Mode.UNHOMED:
        return "not homed: call rig/home first"
    if mode is Mode.FAULT:
        return f"in a fault ({fault_text}): call rig/reset first"
    return f"busy: {mode.name.lower()}"


def refuse_motion(
    command: DriveSine | DriveMove | Park | Tune,
    mode: Mode,
    fault_text: str,
    switches: tuple[bool, bool, bool, bool],
    parameters: LoopParameters,
) -> str | None:
    """Return why a motion cannot be driven now, or None where it can."""
    if mode is not Mode.IDLE:
        return busy_text(mode, fault_text)
    if switches[0] or switches[2]:
        return "an end switch is pressed: call rig/home"
    limits, drive = parameters.motion, parameters.control
    if isinstance(command, DriveSine):
        c, model = command, DriveModel(parameters.model)
        return refuse_sine(c.amplitude, c.angular_frequency, c.cycles, limits, model, drive)
    if isinstance(command, DriveMove):
        return _refuse_move(command, parameters)
    if isinstance(command, Park):
        return refuse_hold(limits.park, 0.0, limits)
    return None


def _refuse_move(move: DriveMove, parameters: LoopParameters) -> str | None:
    limits = parameters.motion
    if move.shape not in tuple(Shape):
        return f"shape {move.shape} is unknown; HOLD is 0, STEP 1, TRIANGLE 2"
    if move.shape != Shape.TRIANGLE:
        return refuse_hold(move.position, move.duration, limits)
    return refuse_triangle(
        move.position, move.amplitude, move.angular_frequency, move.duration, limits, DriveModel(parameters.model),
        parameters.control,
    )  # fmt: skip
