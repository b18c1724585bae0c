"""The zero-rate output follows the supply."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.types import Owner

TOGGLED_V = 0.05
"""V: a supply that moves by more within a run was moved on purpose."""


class SupplyVoltage(Effect):
    """c (V - V0): an output against an absolute reference, sampled by a converter whose reference is the supply."""

    name = "supply_voltage"
    owner = Owner.CHAIN
    equation = "c (V - V0)"
    source = "LISY300AL datasheet: absolute zero-rate level; the converter's reference is the supply"
    parameters = spec("c_x c_y c_z", "rad/s/V", 1e-2)
    dynamic = False
    slow = True
    separating_run = "supply_toggled"
    every_run = True

    def missing(self, drivers: Drivers) -> str | None:
        """It needs the supply voltage, and the temperature or a toggled supply."""
        if drivers.supply is None:
            return "no battery topic; record the cell's voltage, and toggle the supply at rest (supply_toggled)"
        if drivers.temperature is None and float(np.ptp(drivers.supply)) < TOGGLED_V:
            alike = "a warm-up looks like a cell that discharges"
            return f"no temperature topic, and {alike}; toggle the supply at rest (supply_toggled)"
        return None

    def design(self, drivers: Drivers) -> Design:
        """Voltage on each axis, shape (n, 3, 3)."""
        return per_axis(np.zeros(len(drivers)) if drivers.supply is None else drivers.supply)
