"""An independent simulator of rail sessions, to test the identification with.

It shares neither code nor functional forms with the identification or the rig's simulator: the carriage's motion solves
an equation of motion with belt and friction, the rail is a curve in space along which attitude is a rotation matrix,
angular rate is a finite rotation difference, noise a sum of Markov processes. Only the containers of
`gsense_fusion.bags.run` are used, for output.
"""

from __future__ import annotations

from .energy import whitened_energy
from .parameters import Disturbance, PlannedRun, SessionParameters, sweep_plan, turned_plan
from .session import Session, simulate

__all__ = [
    "Disturbance",
    "PlannedRun",
    "Session",
    "SessionParameters",
    "simulate",
    "sweep_plan",
    "turned_plan",
    "whitened_energy",
]
