"""The motor's current against friction gets into the measuring chain."""

from __future__ import annotations

from gsense_fusion.identification.effects.base import Drivers, Effect, TemplateSpec, lacks_motion, per_axis, spec
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.effects.reversals import mean_direction
from gsense_fusion.identification.effects.shape import Shape
from gsense_fusion.identification.types import Owner

DRAG = "friction_drag"
INERTIA = "friction_inertia"


class FrictionPickup(Effect):
    """c sign(v) on each axis, averaged over the sample; it does not turn with the board."""

    name = "friction_pickup"
    owner = Owner.CHAIN
    equation = "c sign(v)"
    source = "Coulomb friction sets the current of a motor in steady motion"
    parameters = spec("c_x c_y c_z", "rad/s", 1e-3)
    separating_run = "motor_beside_board"
    fields = (DRAG, INERTIA)

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """Direction, and what drag and inertia add to it, on each axis, shape (n, 3, 3)."""
        moved, values = drivers.kinematics, drivers.templates
        added = values.get(DRAG) * moved.velocity + values.get(INERTIA) * moved.acceleration
        return per_axis(mean_direction(drivers.time, moved.velocity) + added)


class DragPickup(Shape):
    """The same current overcomes viscous drag too: it acts in the same direction and needs no second effect.

    It shapes the pick-up's own columns. A pick-up of the speed in another direction is one of its own.
    """

    name = "friction_pickup_drag"
    shaped = FrictionPickup
    equation = "c (sign(v) + drag v)"
    source = "grease and seals of the bearings: as much as dry friction at some m/s"
    templates = (TemplateSpec("drag", "s/m", DRAG, (0.15, 0.5, 1.5), 0.0, 5.0, 0.3, owns_effect=True, default=0.0),)


class InertiaPickup(Shape):
    """The same current accelerates the carriage; as it does not turn, a turned board tells it from G.

    In one mounting G has it, and it gains nothing. It acts in the direction of the pick-up itself: what has another one
    (a tilt with the speed) is an effect of its own.
    """

    name = "friction_pickup_inertia"
    shaped = FrictionPickup
    equation = "c (sign(v) + inertia a)"
    source = "mass of the carriage and of the rotor over dry friction: two kilograms over some newtons"
    templates = (
        TemplateSpec("inertia", "s^2/m", INERTIA, (0.3, 1.0, 3.0), 0.0, 10.0, 0.5, owns_effect=True, default=0.0),
    )
