"""Further terms of what the sensor makes of an acceleration: each of its axes has coefficients of its own.

The effect itself has one vector, that of the axis which lay along the rail first. A board that is mounted so that
another axis does shows by how much that one's differ.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gsense_fusion.identification.effects.base import AXIS_LETTERS, Drivers, Effect, spec
from gsense_fusion.identification.effects.design import Mixed
from gsense_fusion.identification.types import ComplexArray, FloatArray


class OwnAxis(Effect):
    """By how much the coefficients differ from the first axis' where one other axis lies along the rail."""

    bought = True
    base: ClassVar[Effect]
    axis: ClassVar[int]

    def missing(self, drivers: Drivers) -> str | None:
        """What the effect itself needs, and a run along this axis beside runs along another one."""
        if drivers.along_axis != self.axis or drivers.first_axis == self.axis:
            return f"never accelerated along the sensor's {AXIS_LETTERS[self.axis]} beside another axis"
        return self.base.missing(drivers)

    def design(self, drivers: Drivers) -> Mixed:
        """The effect's own columns in the runs along the axis, zero in others."""
        own = Mixed.of(self.base.design(drivers))
        return Mixed(own.series * (drivers.along_axis == self.axis), own.spread)

    def vibration(self, frequency_hz: FloatArray, drivers: Drivers) -> ComplexArray | None:
        """The effect's own answer in the runs along the axis."""
        own = self.base.vibration(frequency_hz, drivers)
        return None if own is None else np.asarray(own * (drivers.along_axis == self.axis))


def own_axes(base: Effect) -> tuple[OwnAxis, ...]:
    """The terms of all axes; those are fitted for which there are runs."""
    return tuple(_own_axis(base, axis) for axis in range(3))


def _own_axis(base: Effect, axis: int) -> OwnAxis:
    letter = AXIS_LETTERS[axis]
    first = base.parameters[0]
    made: type[OwnAxis] = type(
        f"{type(base).__name__}Along{letter.upper()}",
        (OwnAxis,),
        {
            "name": f"{base.name}_along_{letter}",
            "owner": base.owner,
            "equation": f"{base.equation} with c + c{letter} where {letter} lies along the rail",
            "source": base.source,
            "parameters": spec(" ".join(f"c{letter}_{x}" for x in AXIS_LETTERS), first.unit, first.plausible),
            "needs": (base.name,),
            "part_of": base.name,
            "fields": (*(t.field for t in base.templates), *base.fields),
            "slow": base.slow,
            "base": base,
            "axis": axis,
            "__module__": __name__,
        },
    )
    return made()
