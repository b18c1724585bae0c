"""Further terms of a curve of the acceleration: a proof mass that stiffens or meets its stop leaves the pure power.

The next power of the same parity is the curve's next order. Without it a large effect keeps a rest that no other effect
explains, and its coefficient is that of the power which fits the whole stroke best, not the curve's at rest.
"""

from __future__ import annotations

from typing import ClassVar

from gsense_fusion.identification.effects.base import Drivers, Effect, along_sign, per_axis, spec
from gsense_fusion.identification.effects.design import Design

USUAL_ACCELERATION = 10.0
"""m/s^2: there a term of plausible size is as large as the effect's own."""


class HigherOrder(Effect):
    """h a^(n + 2) beside c a^n."""

    bought = True
    base: ClassVar[Effect]
    power: ClassVar[int]

    def missing(self, drivers: Drivers) -> str | None:
        """What the effect itself needs."""
        return self.base.missing(drivers)

    def design(self, drivers: Drivers) -> Design:
        """The power of the acceleration in the sensor's axes on each axis, shape (n, 3, 3)."""
        return per_axis((along_sign(drivers) * drivers.acceleration) ** self.power)


def higher_order(base: Effect, power: int) -> HigherOrder:
    """The term of a power beside the effect, which is that of two less."""
    made: type[HigherOrder] = type(
        f"{type(base).__name__}HigherOrder",
        (HigherOrder,),
        {
            "name": f"{base.name}_higher_order",
            "owner": base.owner,
            "equation": f"{base.equation} + h a^{power}",
            "source": base.source,
            "parameters": spec(
                "h_x h_y h_z", f"(rad/s)/(m/s^2)^{power}", base.parameters[0].plausible / USUAL_ACCELERATION**2
            ),
            "needs": (base.name,),
            "part_of": base.name,
            "slow": base.slow,
            "base": base,
            "power": power,
            "__module__": __name__,
        },
    )
    return made()
