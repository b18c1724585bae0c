"""Terms that follow the board's state: temperature and supply."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from gsense_fusion.compensation.document import Section, Vector
from gsense_fusion.compensation.terms.numbers import KIND_SUPPLY, KIND_TEMPERATURE, FloatArray, as_row, finite, floats


@dataclass(frozen=True)
class TemperatureBias:
    """Rate `c (T' - reference)`; T' follows the die temperature with a first-order lag."""

    effect: ClassVar[str] = "temperature_bias"
    unit: ClassVar[str] = "rad/s/K"
    kind: ClassVar[int] = KIND_TEMPERATURE

    c: Vector
    reference: float
    """degrees Celsius."""
    lag_s: float = 0.0
    """Time constant, s; 0: no lag."""

    @staticmethod
    def parse(section: Section) -> TemperatureBias:
        """From its entry."""
        lag = section.number("lag_s", 0.0)
        if lag < 0:
            raise ValueError(f"{section.path}lag_s: {lag} is negative")
        return TemperatureBias(section.vector("c"), section.number("reference"), lag)

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {"c": floats(self.c), "reference": finite(self.reference), "lag_s": finite(self.lag_s)}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return as_row(c=self.c, reference=self.reference, lag=self.lag_s)


@dataclass(frozen=True)
class SupplyVoltage:
    """Rate `c (V - reference)` with the newest voltage of the board's cell."""

    effect: ClassVar[str] = "supply_voltage"
    unit: ClassVar[str] = "rad/s/V"
    kind: ClassVar[int] = KIND_SUPPLY

    c: Vector
    reference: float
    """V."""

    @staticmethod
    def parse(section: Section) -> SupplyVoltage:
        """From its entry."""
        return SupplyVoltage(section.vector("c"), section.number("reference"))

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {"c": floats(self.c), "reference": finite(self.reference)}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return as_row(c=self.c, reference=self.reference)
