"""What changes the noise and not the mean: found in the residual of the complete model, with no columns of its own."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, lacks_motion
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.types import Parameter
from gsense_fusion.identification.verdict.residual import WindowResidual


@dataclass(frozen=True)
class Explanation:
    """A statistical effect that was seen in the residual."""

    parameters: Mapping[str, Parameter]
    axes: tuple[str, ...]
    p_value: float
    windows: tuple[WindowResidual, ...]
    """The residual without it: what the tests for anything left look at next."""
    removable: float
    """Root mean square of what could be subtracted if its phase were known, rad/s, axes root-summed."""
    level: float = 1.0
    """How many times the power of the noise at rest is there in the noisiest run."""
    settles: str = ""
    """Kind of symptom that this is the answer to whatever the windows say: one that they do not show."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What a statistical effect is looked for in."""

    likelihood: Likelihood
    fit: Fit
    windows: tuple[WindowResidual, ...]
    """Its residual."""


class StatisticalEffect(Effect):
    """An entry of the catalogue that explains a symptom of some kind."""

    parameters = ()
    symptom: str
    """Kind of symptom that it explains, and that must vanish with it."""

    @abstractmethod
    def explain(self, seen: Seen) -> Explanation | None:
        """The effect in the residual of a fit, or None where they do not look like it."""

    def missing(self, drivers: Drivers) -> str | None:
        """It needs motion along the rail."""
        return lacks_motion(drivers)

    def design(self, drivers: Drivers) -> Design:
        """No columns, shape (n, 3, 0)."""
        return np.zeros((len(drivers), 3, 0))
