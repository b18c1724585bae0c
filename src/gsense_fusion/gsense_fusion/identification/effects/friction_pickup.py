"""The motor's current against friction gets into the measuring chain."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, TemplateSpec, lacks_motion, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.effects.reversals import mean_direction
from gsense_fusion.identification.effects.shape import Shape
from gsense_fusion.identification.types import Owner

DRAG = "friction_drag"


class FrictionPickup(Effect):
    """c sign(v) on each axis, averaged over the sample; it does not turn with the board."""

    name = "friction_pickup"
    owner = Owner.CHAIN
    equation = "c sign(v)"
    source = "Coulomb friction sets the current of a motor in steady motion"
    parameters = spec("c_x c_y c_z", "rad/s", 1e-3)
    separating_run = "motor_beside_board"
    fields = (DRAG,)

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Direction, and what drag adds to it, on each axis, shape (n, 3, 3)."""
        speed = drivers.kinematics.velocity
        return per_axis(mean_direction(drivers.time, speed) + drivers.templates.get(DRAG) * speed)


class DragPickup(Shape):
    """The same current overcomes viscous drag too: it acts in the same direction and needs no second effect.

    It shapes the pick-up's own columns. A pick-up of the speed in another direction is one of its own.
    """

    name = "friction_pickup_drag"
    shaped = FrictionPickup
    equation = "c (sign(v) + drag v)"
    source = "grease and seals of the bearings: as much as dry friction at some m/s"
    templates = (TemplateSpec("drag", "s/m", DRAG, (0.15, 0.5, 1.5), 0.0, 5.0, 0.3, owns_effect=True, default=0.0),)


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
