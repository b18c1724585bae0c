"""What the simulated rail keeps in memory that two processes may share: physics and outputs. Imports nothing heavy."""

from __future__ import annotations

import math

from gsense_rig.hardware.interface import MOTOR_OFF, MotorOutput
from gsense_rig.plant.state import CURRENT, PULLEY, STATE_SIZE, TIME

_DUTY = STATE_SIZE
_DISABLED, _LIGHT, _ZERO = _DUTY + 1, _DUTY + 2, _DUTY + 3
SIZE = 8 * (_ZERO + 1)
"""Bytes."""


class RailMemory:
    """State of the plant, then duty, DIS, light and the encoder's zero, as float64 over a writable buffer.

    Args:
        buffer: of `SIZE` bytes or more (a shared mmap); private memory where None.
    """

    def __init__(self, buffer: memoryview | None = None) -> None:
        fresh = buffer is None
        self.values = memoryview(bytearray(SIZE) if buffer is None else buffer[:SIZE]).cast("B").cast("d")
        if fresh:
            self.output = MOTOR_OFF

    @property
    def time(self) -> float:
        """Time that the physics has reached [s]."""
        return float(self.values[TIME])

    @property
    def current(self) -> float:
        """True motor current [A]."""
        return float(self.values[CURRENT])

    @property
    def zero(self) -> float:
        """True position at which the encoder counts zero [m]."""
        return float(self.values[_ZERO])

    @zero.setter
    def zero(self, position: float) -> None:
        self.values[_ZERO] = position

    @property
    def output(self) -> MotorOutput:
        """Bridge inputs and light that the physics runs under."""
        v = self.values
        return MotorOutput(v[_DUTY], v[_DISABLED] != 0.0, int(v[_LIGHT]))

    @output.setter
    def output(self, output: MotorOutput) -> None:
        self.values[_DUTY] = output.duty
        self.values[_DISABLED] = float(output.disabled)
        self.values[_LIGHT] = float(output.light)

    def counts(self, counts_per_metre: float) -> int:
        """What an encoder without faults counts."""
        return math.floor((self.values[PULLEY] - self.zero) * counts_per_metre)
