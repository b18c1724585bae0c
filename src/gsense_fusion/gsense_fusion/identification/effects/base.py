"""What an effect is: one small unit of code with its name, owner, equation, drivers and regressors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gsense_fusion.identification.motion import Kinematics
from gsense_fusion.identification.mounting import Mounting
from gsense_fusion.identification.types import FloatArray, Owner


@dataclass(frozen=True)
class Drivers:
    """What may drive an effect, on the samples (or block means) of one run; the same n everywhere."""

    kinematics: Kinematics
    """Carriage motion at the gyro's sample times."""
    mounting: Mounting | None
    specific_force: FloatArray | None
    """m/s^2, shape (n, 3), sensor axes, free of noise: gravity and the carriage's acceleration through the mounting."""
    temperature: FloatArray | None
    """Die temperature minus `TEMPERATURE_REFERENCE`, K, shape (n,)."""
    time: FloatArray
    """s, shape (n,)."""

    def __len__(self) -> int:
        return len(self.time)


@dataclass(frozen=True)
class ParameterSpec:
    """One parameter of an effect."""

    name: str
    unit: str
    plausible: float
    """Size that nobody would wonder at, in the unit. A direction of the parameters that the data cannot pin down to a
    part of it is left at zero: a turned board that is off by milliradians must not make up columns of G."""


@dataclass(frozen=True)
class TemplateSpec:
    """A parameter in which the regressors are not linear: it is searched on a grid, then refined.

    `field` names the value of `Templates` that it sets.
    """

    name: str
    unit: str
    field: str
    grid: tuple[float, ...]
    lower: float
    upper: float
    plausible: float
    """How far off nobody would wonder at, in the unit: what is assumed where the data does not tell."""
    owns_effect: bool = False
    """The effect exists by this parameter alone (time_offset); else it refines one (lag of temperature_bias)."""


@dataclass(frozen=True)
class Templates:
    """Values of the searched parameters of a model."""

    gyro_delay_s: float = 0.0
    temperature_lag_s: float = 0.0

    @property
    def fast(self) -> Templates:
        """Only what matters within a drive period."""
        return Templates(gyro_delay_s=self.gyro_delay_s)

    @property
    def slow(self) -> Templates:
        """Only what matters for means over whole drive periods."""
        return Templates(temperature_lag_s=self.temperature_lag_s)


class Effect(ABC):
    """One entry of the catalogue, linear in `parameters`; what is not linear stands in `templates`."""

    name: ClassVar[str]
    owner: ClassVar[Owner]
    equation: ClassVar[str]
    source: ClassVar[str]
    parameters: ClassVar[tuple[ParameterSpec, ...]]
    templates: ClassVar[tuple[TemplateSpec, ...]] = ()
    dynamic: ClassVar[bool] = True
    """Driven by the motion (then leave-one-run-out is a veto), not by slow quantities."""
    separating_run: ClassVar[str | None] = None
    """The run that would separate it from its usual rivals."""
    every_run: ClassVar[bool] = False
    """Whether every run must have what the effect needs; else one is enough."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Effects that must be in the model for this one to be visible."""

    @abstractmethod
    def missing(self, drivers: Drivers) -> str | None:
        """What this run lacks for the effect to be decided, in words; None where nothing."""

    @abstractmethod
    def design(self, drivers: Drivers) -> FloatArray:
        """Derivative of the three gyro axes by the parameters, shape (n, 3, p), rad/s per unit."""


def per_axis(driver: FloatArray) -> FloatArray:
    """Design of an effect that adds c_axis times one driver (n,) to each gyro axis, shape (n, 3, 3)."""
    return np.asarray(driver[:, None, None] * np.eye(3)[None])


def spec(names: str, unit: str, plausible: float) -> tuple[ParameterSpec, ...]:
    """Parameters of one unit and plausible size, names separated by blanks."""
    return tuple(ParameterSpec(name, unit, plausible) for name in names.split())
