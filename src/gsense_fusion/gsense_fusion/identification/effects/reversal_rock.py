"""Play in the bearings: the carriage turns within the first fraction of a millimetre after each reversal."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import (
    Drivers,
    Effect,
    TemplateSpec,
    about_rail_axes,
    lacks_direction,
    spec,
)
from gsense_fusion.identification.effects.reversals import rock_rate
from gsense_fusion.identification.types import FloatArray, Owner


class ReversalRock(Effect):
    """True turn from -r to r about the rail's axes while the carriage travels the width after a reversal."""

    name = "reversal_rock"
    owner = Owner.RIG
    equation = "R r d/dt (1 - 2 exp(-travel / width)) sign(v)"
    source = "clearance of linear bearings: 0.01 deg"
    parameters = spec("r_x r_y r_z", "rad", 1e-3)
    templates = (
        TemplateSpec("width", "m", "rock_width_m", (5e-5, 2e-4, 5e-4, 1.5e-3, 4e-3), 1e-5, 0.01, 5e-4, default=5e-4),
    )
    separating_run = "board_turned_180"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail, and the rail's direction in the sensor's axes."""
        return lacks_direction(drivers)

    def design(self, drivers: Drivers) -> FloatArray:
        """Rate of the turn about the rail's axes, shape (n, 3, 3)."""
        kin, width = drivers.kinematics, drivers.templates.get("rock_width_m", 5e-4)
        return about_rail_axes(drivers, rock_rate(drivers.time, kin.position, kin.velocity, width))
