"""Whether a sine may be driven now; asked by the loop, and by the node ahead of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gsense_rig.control.limits import refuse_sine
from gsense_rig.control.model import DriveModel
from gsense_rig.safety.modes import Mode

if TYPE_CHECKING:
    from gsense_rig.loop.messages import DriveSine
    from gsense_rig.loop.parameters import LoopParameters


def busy_text(mode: Mode, fault_text: str) -> str:
    """Why a mode takes no motion."""
    if mode is Mode.UNHOMED:
        return "not homed: call rig/home first"
    if mode is Mode.FAULT:
        return f"in a fault ({fault_text}): call rig/reset first"
    return f"busy: {mode.name.lower()}"


def refuse_drive(
    command: DriveSine,
    mode: Mode,
    fault_text: str,
    switches: tuple[bool, bool, bool, bool],
    parameters: LoopParameters,
) -> str | None:
    """Return why a sine cannot be driven now, or None where it can."""
    if mode is not Mode.IDLE:
        return busy_text(mode, fault_text)
    if switches[0] or switches[2]:
        return "an end switch is pressed: call rig/home"
    return refuse_sine(
        command.amplitude,
        command.angular_frequency,
        command.cycles,
        parameters.motion,
        DriveModel(parameters.model),
        parameters.control,
    )
