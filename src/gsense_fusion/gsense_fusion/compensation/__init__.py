"""What is taken off the angular rate: the file that says it, and its causal application."""

from .apply import Compensator, compensate
from .model import (
    CompensationError,
    CompensationFile,
    GSensitivity,
    ReferenceTerm,
    TemperatureBias,
    load_compensation,
    write_compensation,
)

__all__ = [
    "CompensationError",
    "CompensationFile",
    "Compensator",
    "GSensitivity",
    "ReferenceTerm",
    "TemperatureBias",
    "compensate",
    "load_compensation",
    "write_compensation",
]
