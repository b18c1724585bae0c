"""The rail's hardware as the loop knows it: position on the rail's own zero, estimated motion, outputs in force."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gsense_rig.control.estimators import TUNED_NOISE, DriveObserver
from gsense_rig.control.model import DriveModel
from gsense_rig.hardware.interface import MOTOR_OFF, HardwareError, HardwareReading, MotorOutput

if TYPE_CHECKING:
    from gsense_rig.hardware.interface import RailHardware
    from gsense_rig.loop.parameters import LoopParameters


class Axis:
    """Reads and writes the hardware once a period.

    Attributes:
        model: the loop's belief about the drive.
        observer: estimates position, velocity and acceleration.
        position: of the encoder [m], from the rail's middle once that is known.
        reading: the newest one; None before the first.
        output: what was written last.
    """

    def __init__(self, hardware: RailHardware, parameters: LoopParameters) -> None:
        self.model = DriveModel(parameters.model)
        self.observer = make_observer(parameters)
        self.position = 0.0
        self.reading: HardwareReading | None = None
        self.output = MOTOR_OFF
        self._hardware = hardware
        self._zero_counts = 0.0

    @property
    def voltage(self) -> float | None:
        """Voltage on the motor since the last write [V]; None: bridge open."""
        return None if self.output.disabled else self.model.duty_voltage(self.output.duty)

    @property
    def emf_speed(self) -> float | None:
        """Speed by the motor's back EMF, of voltage and current [m/s]; None: bridge open, or no current known."""
        voltage = self.voltage
        if voltage is None or self.reading is None or math.isnan(self.reading.current):
            return None
        drive = self.model.drive
        return (voltage - drive.resistance * self.reading.current) / drive.force_constant

    def read(self) -> HardwareReading:
        """Read the inputs and update position and observer.

        Raises:
            HardwareError: the hardware does not answer; the observer then goes on by the model alone.
        """
        try:
            reading = self._hardware.read()
        except HardwareError:
            self.observer.predict(self.voltage)
            raise
        first, self.reading = self.reading is None, reading
        self.position = (reading.counts - self._zero_counts) / self._hardware.counts_per_metre
        if first:
            self.observer.reset(self.position)
        self.observer.update(self.position, self.voltage)
        return reading

    def write(self, duty: float, disabled: bool, light: int) -> None:
        """Write the outputs.

        Raises:
            HardwareError: the hardware does not answer.
        """
        self.output = MotorOutput(duty, disabled, light)
        self._hardware.write(self.output)

    def use_model(self, parameters: LoopParameters) -> None:
        """Take over another belief about the drive; the carriage must be at rest."""
        self.model = DriveModel(parameters.model)
        self.observer = make_observer(parameters)
        self.observer.reset(self.position)

    def shift_zero(self, offset: float) -> None:
        """Move the zero: positions become smaller by offset [m]."""
        self._zero_counts += offset * self._hardware.counts_per_metre
        self.observer.shift(offset)
        self.position -= offset


def make_observer(parameters: LoopParameters) -> DriveObserver:
    """Observer that trusts its model more where that was identified."""
    return DriveObserver(parameters.model, parameters.period, TUNED_NOISE if parameters.tuned else None)
