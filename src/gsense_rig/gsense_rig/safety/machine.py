"""The state machine: which mode the rail is in, which fault is latched, whether the zero is known."""

from __future__ import annotations

from typing import NamedTuple

from gsense_rig.safety.modes import KEEPS_POSITION, LIGHTS, Fault, Light, Mode


class Finding(NamedTuple):
    """A fault and its text."""

    fault: Fault
    text: str


class StateMachine:
    """Mode, latched fault and knowledge of the zero.

    Attributes:
        mode: present mode.
        fault: latched fault; NONE outside FAULT.
        fault_text: its one line.
        homed: whether position 0 is the rail's middle.
    """

    def __init__(self) -> None:
        self.mode = Mode.UNHOMED
        self.fault = Fault.NONE
        self.fault_text = ""
        self.homed = False

    @property
    def light(self) -> Light:
        """What the traffic light shows."""
        return LIGHTS[self.mode]

    @property
    def resting(self) -> bool:
        """Whether the mode is one in which nothing is driven (a fault may still brake)."""
        return self.mode in (Mode.UNHOMED, Mode.IDLE, Mode.FAULT)

    def enter(self, mode: Mode) -> None:
        """Begin HOMING (the zero is forgotten), RUNNING or STOPPING."""
        self.mode = mode
        if mode is Mode.HOMING:
            self.homed = False

    def rest(self) -> None:
        """Motion is over: IDLE, or UNHOMED where the zero is not known."""
        self.mode = Mode.IDLE if self.homed else Mode.UNHOMED

    def zero_found(self) -> None:
        """Homing is done."""
        self.homed, self.mode = True, Mode.IDLE

    def trip(self, finding: Finding) -> None:
        """Latch a fault."""
        self.mode, self.fault, self.fault_text = Mode.FAULT, finding.fault, finding.text

    def reset(self) -> None:
        """Leave FAULT; the zero stays known only where the fault says nothing against it."""
        self.homed = self.homed and self.fault in KEEPS_POSITION
        self.fault, self.fault_text = Fault.NONE, ""
        self.rest()
