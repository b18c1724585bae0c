"""What is taken off the angular rate: the file that says it, and its causal application."""

from .apply import Compensator, CompensatorState, compensate, corrected_field, corrected_force, gather_inputs
from .document import Matrix, Vector
from .model import (
    AccelerometerCorrection,
    CompensationError,
    CompensationFile,
    MagnetometerCorrection,
    ReferenceTerm,
    load_compensation,
    rail_power,
    write_compensation,
)
from .terms import (
    FrictionPickup,
    GCubed,
    GResonance,
    GSensitivity,
    GSquared,
    JerkCoupling,
    ScaleMisalignment,
    SpeedPickup,
    SupplyVoltage,
    TemperatureBias,
    Term,
)

__all__ = [
    "AccelerometerCorrection",
    "CompensationError",
    "CompensationFile",
    "Compensator",
    "CompensatorState",
    "FrictionPickup",
    "GCubed",
    "GResonance",
    "GSensitivity",
    "GSquared",
    "JerkCoupling",
    "MagnetometerCorrection",
    "Matrix",
    "ReferenceTerm",
    "ScaleMisalignment",
    "SpeedPickup",
    "SupplyVoltage",
    "TemperatureBias",
    "Term",
    "Vector",
    "compensate",
    "corrected_field",
    "corrected_force",
    "gather_inputs",
    "load_compensation",
    "rail_power",
    "write_compensation",
]
