"""Play in the bearings: the carriage turns within the first fraction of a millimetre after each reversal."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, TemplateSpec, spec
from gsense_fusion.identification.effects.reversals import rock_angle, rock_rate
from gsense_fusion.identification.effects.turning import TrueTurn
from gsense_fusion.identification.types import FloatArray


class ReversalRock(TrueTurn):
    """True turn from -r to r about the rail's axes while the carriage travels the width after a reversal."""

    name = "reversal_rock"
    equation = "R r d/dt (1 - 2 exp(-travel / width)) sign(v)"
    source = "clearance of linear bearings: 0.01 deg"
    parameters = spec("r_x r_y r_z", "rad", 1e-3)
    templates = (
        TemplateSpec("width", "m", "rock_width_m", (5e-5, 2e-4, 5e-4, 1.5e-3, 4e-3), 1e-5, 0.01, 5e-4, default=5e-4),
    )

    def angle(self, drivers: Drivers) -> FloatArray:
        """The turn itself, from -1 to 1."""
        kin, width = drivers.kinematics, drivers.templates.get("rock_width_m", 5e-4)
        edges = rock_angle(drivers.time, kin.position, kin.velocity, width)
        return (edges[1:] + edges[:-1]) / 2

    def rate(self, drivers: Drivers) -> FloatArray:
        """Rate of the turn, averaged over each sample's interval, as the gyro's filter leaves it."""
        kin, width = drivers.kinematics, drivers.templates.get("rock_width_m", 5e-4)
        rate = rock_rate(drivers.time, kin.position, kin.velocity, width)
        if drivers.response is None:
            return rate
        return drivers.response.passed(rate, 1.0 / float(np.median(np.diff(drivers.time))))
