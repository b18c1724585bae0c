"""The motor's current against friction gets into the measuring chain."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, lacks_motion, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.effects.reversals import mean_direction
from gsense_fusion.identification.types import Owner


class FrictionPickup(Effect):
    """c sign(v) on each axis, averaged over the sample; it does not turn with the board."""

    name = "friction_pickup"
    owner = Owner.CHAIN
    equation = "c sign(v)"
    source = "Coulomb friction sets the current of a motor in steady motion"
    parameters = spec("c_x c_y c_z", "rad/s", 1e-3)
    separating_run = "motor_beside_board"

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Direction on each axis, shape (n, 3, 3)."""
        return per_axis(mean_direction(drivers.time, drivers.kinematics.velocity))


class InertiaPickup(Effect):
    """The current that accelerates the carriage: it hides in G unless the board is turned, for it does not turn.

    It has to be bought: in one mounting it gains nothing, and would take half of G.
    """

    name = "friction_pickup_inertia"
    owner = Owner.CHAIN
    equation = "c' a"
    source = FrictionPickup.source
    parameters = spec("inertia_x inertia_y inertia_z", "(rad/s)/(m/s^2)", 3e-4)
    needs = ("friction_pickup",)
    part_of = "friction_pickup"
    bought = True

    def missing(self, drivers: Drivers) -> str | None:
        """What the pick-up needs."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Acceleration on each axis, shape (n, 3, 3)."""
        return per_axis(drivers.kinematics.acceleration)
