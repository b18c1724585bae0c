"""Attitude filters behind one interface: angular rate, specific force and magnetic field in, attitude out.

All of them by name are in `registry`: their kernels take half a second to load.
"""

from .initial import attitude_at_rest
from .interface import AttitudeFilter
from .madgwick import Madgwick, MadgwickParameters, MadgwickState

__all__ = [
    "AttitudeFilter",
    "Madgwick",
    "MadgwickParameters",
    "MadgwickState",
    "attitude_at_rest",
]
