"""Attitude filters behind one interface: angular rate, specific force and magnetic field in, attitude out."""

from .initial import attitude_at_rest
from .interface import AttitudeFilter
from .madgwick import Madgwick, MadgwickParameters, MadgwickState
from .registry import FILTERS, UnknownFilterError, filter_kind

__all__ = [
    "FILTERS",
    "AttitudeFilter",
    "Madgwick",
    "MadgwickParameters",
    "MadgwickState",
    "UnknownFilterError",
    "attitude_at_rest",
    "filter_kind",
]
