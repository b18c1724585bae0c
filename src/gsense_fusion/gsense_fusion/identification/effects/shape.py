"""Further terms without columns: what they search shapes the columns of the effect that they are part of."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect
from gsense_fusion.identification.effects.design import Design


class Shape(Effect):
    """A searched shape of another effect's columns, in a model only where the search bought it."""

    shaped: ClassVar[type[Effect]]
    """The effect whose columns depend on it; that one names the searched values in `fields`."""
    parameters = ()
    bought = True

    def __init_subclass__(cls) -> None:
        """What follows from the effect that is shaped."""
        super().__init_subclass__()
        cls.owner = cls.shaped.owner
        cls.needs = (cls.shaped.name,)
        cls.part_of = cls.shaped.name

    def missing(self, drivers: Drivers) -> str | None:
        """What the shaped effect needs."""
        return self.shaped().missing(drivers)

    def design(self, drivers: Drivers) -> Design:
        """No columns, shape (n, 3, 0)."""
        return np.zeros((len(drivers), 3, 0))
