"""Parameters of the loop, gathered."""

from __future__ import annotations

from dataclasses import dataclass, field

from gsense_rig.control.controllers import ControlLimits
from gsense_rig.control.limits import MotionLimits
from gsense_rig.plant.parameters import DriveParameters, PlantParameters
from gsense_rig.safety.brake import BrakeParameters
from gsense_rig.safety.homing import HomingParameters
from gsense_rig.safety.monitor import SafetyLimits


@dataclass(frozen=True)
class LoopParameters:
    """What the loop is made of.

    `model` is the controller's belief about the drive, `plant` the simulation's truth; they may differ.
    """

    rate: float = 600.0  # Hz; three ticks to one 200 Hz pose, so poses are evenly spaced
    controller: str = "feedforward"  # or pi, the thesis's
    model: DriveParameters = field(default_factory=DriveParameters)
    tuned: bool = False  # the model was identified (or is the plant's own): softer feedback, steadier observer
    plant: PlantParameters = field(default_factory=PlantParameters)
    control: ControlLimits = field(default_factory=ControlLimits)
    motion: MotionLimits = field(default_factory=MotionLimits)
    safety: SafetyLimits = field(default_factory=SafetyLimits)
    homing: HomingParameters = field(default_factory=HomingParameters)
    settle: float = 0.15  # s held at the end of a motion before the motor goes off
    brake: BrakeParameters = field(default_factory=BrakeParameters)

    @property
    def period(self) -> float:
        """Seconds between two ticks."""
        return 1.0 / self.rate
