"""Terms that follow the carriage's velocity."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from gsense_fusion.compensation.document import Section, Vector
from gsense_fusion.compensation.terms.numbers import KIND_FRICTION, KIND_SPEED, FloatArray, as_row, finite, floats


@dataclass(frozen=True)
class _CarriageEffect:
    """What follows the carriage's velocity; needs `rig/joint_states`."""

    effect: ClassVar[str]
    unit: ClassVar[str]
    kind: ClassVar[int]

    c: Vector

    @classmethod
    def parse(cls, section: Section) -> Any:
        """From its entry."""
        return cls(section.vector("c"))

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {"c": floats(self.c)}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return as_row(c=self.c)


@dataclass(frozen=True)
class FrictionPickup(_CarriageEffect):
    """`c (sign(v) + inertia v')`: motor current against friction and inertia, in the gyro's supply or wires."""

    effect: ClassVar[str] = "friction_pickup"
    unit: ClassVar[str] = "rad/s"
    kind: ClassVar[int] = KIND_FRICTION

    inertia: float = 0.0
    """s^2/m: what the current against inertia is to that against dry friction, per acceleration."""

    @classmethod
    def parse(cls, section: Section) -> FrictionPickup:
        """From its entry."""
        return cls(section.vector("c"), section.number("inertia", 0.0))

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {**super().document(), **({"inertia": finite(self.inertia)} if self.inertia else {})}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return as_row(c=self.c, lag=self.inertia)


@dataclass(frozen=True)
class SpeedPickup(_CarriageEffect):
    """`c v`: back-EMF, no true rotation."""

    effect: ClassVar[str] = "speed_pickup"
    unit: ClassVar[str] = "(rad/s)/(m/s)"
    kind: ClassVar[int] = KIND_SPEED
