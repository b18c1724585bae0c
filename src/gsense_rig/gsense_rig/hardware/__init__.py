"""The rail's inputs and outputs: one small interface, implemented by the simulation and by the DAQ card."""

from gsense_rig.hardware.interface import HardwareError, HardwareReading, MotorOutput, RailHardware

__all__ = ["HardwareError", "HardwareReading", "MotorOutput", "RailHardware"]
