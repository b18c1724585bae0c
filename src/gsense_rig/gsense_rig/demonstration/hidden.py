"""The effect that is hidden in a demonstration's simulated board, drawn by the seed."""

from __future__ import annotations

import math
import random
from dataclasses import dataclass


@dataclass(frozen=True)
class Kind:
    """An effect that can be hidden, with realistic sizes that are clearly above what a short campaign can detect."""

    name: str
    low: float
    high: float
    parameters: tuple[str, ...]
    """Parameters of the effect that have the value (a vector's is the same on each axis)."""
    unit: str


KINDS = (
    Kind("temperature_bias", 3e-4, 2e-3, ("c_x", "c_y", "c_z"), "rad/s/K"),
    Kind("rail_curvature", 1.5e-3, 6e-3, ("t_x", "t_y", "t_z"), "rad/m"),
    Kind("time_offset", 8e-3, 30e-3, ("tau",), "s"),
)


@dataclass(frozen=True)
class HiddenEffect:
    """One effect with its size."""

    kind: Kind
    value: float
    """SI."""

    @property
    def argument(self) -> str:
        """NAME=VALUE, as rig and simulate take it."""
        return f"{self.kind.name}={self.value!r}"

    @property
    def truth(self) -> dict[str, float]:
        """True value of each parameter, SI."""
        return dict.fromkeys(self.kind.parameters, self.value)


def draw(seed: int) -> HiddenEffect:
    """The effect of a seed: any of the kinds alike, its size log-uniform; three significant digits."""
    rng = random.Random(f"hidden effect {seed}")  # noqa: S311 - no secret
    kind = rng.choice(KINDS)
    value = math.exp(rng.uniform(math.log(kind.low), math.log(kind.high)))
    return HiddenEffect(kind, float(f"{value:.3g}"))
