"""What an effect is: one small unit of code with its name, owner, equation, drivers and regressors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from gsense_fusion.identification.effects.design import Design, Mixed, RailForce
from gsense_fusion.identification.motion.harmonics import Kinematics
from gsense_fusion.identification.motion.mounting import Mounting
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.types import ComplexArray, FloatArray, Owner, Parameter

AXIS_LETTERS = "xyz"
UNIFORM = 1e-6
"""Relative difference of two steps under which a grid is equidistant: a single sample lost among a million shows."""


@dataclass(frozen=True)
class Templates:
    """Values of the searched parameters of a model, by field; a field that is absent has its effect's default."""

    values: tuple[tuple[str, float], ...] = ()

    def get(self, field: str, default: float = 0.0) -> float:
        """Value of a field."""
        return next((v for f, v in self.values if f == field), default)

    def set(self, field: str, value: float) -> Templates:
        """The same with one value changed."""
        return Templates(tuple(sorted({**dict(self.values), field: value}.items())))

    def only(self, fields: frozenset[str]) -> Templates:
        """The values of some fields."""
        return Templates(tuple((f, v) for f, v in self.values if f in fields))

    @property
    def gyro_delay_s(self) -> float:
        """How much later the gyro is than the accelerometer, s."""
        return self.get("gyro_delay_s")

    @property
    def temperature_lag_s(self) -> float:
        """Lag of the gyro's element behind the die's thermometer, s."""
        return self.get("temperature_lag_s")


@dataclass(frozen=True)
class Drivers:
    """What may drive an effect, on the samples (or block means) of one run; the same n everywhere."""

    kinematics: Kinematics
    """Carriage motion at the gyro's sample times."""
    mounting: Mounting | None
    force: FloatArray | RailForce | None
    """Specific force in m/s^2, sensor axes, free of noise: gravity and the carriage's acceleration through the
    mounting; as vectors (n, 3) or in two series."""
    temperature: FloatArray | None
    """Die temperature minus `TEMPERATURE_REFERENCE`, K, shape (n,)."""
    time: FloatArray
    """s, shape (n,)."""
    supply: FloatArray | None = None
    """Supply voltage minus the campaign's mean, V, shape (n,)."""
    response: Response | None = None
    """What the gyro's filter leaves of a signal, by frequency; None where nothing is known of it."""
    templates: Templates = Templates()
    """Values of the searched parameters."""
    on_time: Kinematics | None = None
    """The same motion without the gyro's delay; None where that is none."""
    ringing: FloatArray | None = None
    """Acceleration in m/s^2 and jerk in m/s^3 along the rail that are felt beyond its rigid motion, shape (2, n)."""

    @property
    def specific_force(self) -> FloatArray | None:
        """The force as vectors, m/s^2, shape (n, 3)."""
        return self.force.vectors if isinstance(self.force, RailForce) else self.force

    first_axis: int | None = None
    """The sensor's axis that lay nearest to the rail in the campaign's first run with a motion."""

    @property
    def along_axis(self) -> int | None:
        """The sensor's axis that lies nearest to the rail."""
        return nearest_axis(self.mounting)

    @property
    def acceleration(self) -> FloatArray:
        """Along the rail with all that is felt of it, m/s^2, shape (n,): what drives a response to shaking."""
        own = self.kinematics.acceleration
        return own if self.ringing is None else np.asarray(own + self.ringing[0])

    @property
    def jerk(self) -> FloatArray:
        """Its derivative, m/s^3, shape (n,)."""
        own = self.kinematics.jerk
        return own if self.ringing is None else np.asarray(own + self.ringing[1])

    def __len__(self) -> int:
        return len(self.time)

    @property
    def step_s(self) -> float:
        """From one sample to the next."""
        return step_of(self.time)


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
    """The effect exists by this parameter alone (time_offset): it must differ from zero."""
    default: float = 0.0
    optional: bool = False
    """It refines an effect that exists without it (lag of temperature_bias); it is paid for where it leaves its
    default. Others are always paid for."""
    below_upper: bool = False
    """At the upper end of its range the effect acts like something else: that must be out of the question."""
    known_to: float = float("inf")
    """Part of it that must be out of the question on either side, else the effect may be something else."""
    gaps: bool = False
    """An instant, which may lie where no run was recorded or fitted: then its mean is taken."""


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
    separates: ClassVar[Mapping[str, str]] = MappingProxyType({})
    """The run that would separate it from one particular rival."""
    rarity: ClassVar[float] = 0.0
    """Prior odds against it, in twice their logarithm: what it must explain better than a commoner effect does."""
    slow: ClassVar[bool] = False
    """Whether it moves the mean over drive periods."""
    part_of: ClassVar[str | None] = None
    """Effect of which this one is a further term: never claimed alone, reported with it."""
    bought: ClassVar[bool] = False
    """Of a further term: it is in a model only where the search took it, not wherever its effect is."""
    refines: ClassVar[bool] = False
    """Of a further term that need not be bought: it refines a shape and costs as little as one that has to be."""
    family: ClassVar[str | None] = None
    """Effects of one family look alike to first order: one of them with its shape is likelier than two."""
    every_run: ClassVar[bool] = False
    """Whether every run must have what the effect needs; else one is enough."""
    memoryless: ClassVar[bool] = False
    """A curve of the force alone: what rounding to a coarse step makes of G f looks like it."""
    needs: ClassVar[tuple[str, ...]] = ()
    """Effects that must be in the model for this one to be visible."""

    wide_band: ClassVar[bool] = False
    """Whether it acts above the band in which all effects are fitted: then it has rows of its own there."""
    fields: ClassVar[tuple[str, ...]] = ()
    """Searched parameters of another effect on which its columns depend too."""

    @abstractmethod
    def missing(self, drivers: Drivers) -> str | None:
        """What this run lacks for the effect to be decided, in words; None where nothing."""

    @abstractmethod
    def design(self, drivers: Drivers) -> Design:
        """Derivative of the three gyro axes by the parameters, shape (n, 3, p), rad/s per unit.

        An array, or a few series with their spread over the axes; p and k must not depend on the run.
        """

    def felt(self, drivers: Drivers) -> Design | None:  # noqa: ARG002  (most effects turn nothing)
        """Derivative of the specific force by the parameters, shape (n, 3, p), m/s^2 per unit; None where zero."""
        return None

    def vibration(self, frequency_hz: FloatArray, drivers: Drivers) -> ComplexArray | None:  # noqa: ARG002
        """What the parameters make of a vibration along the rail that the encoder does not show, by frequency.

        Returns:
            Rate's spectrum per unit of the acceleration's and of the parameters, shape (m, 3, p); None where zero.

        """
        return None

    def report(self, parameters: dict[str, Parameter]) -> dict[str, Parameter]:
        """The parameters as the catalogue names them, from those of the columns and the templates."""
        return parameters


def parts_of(effects: Iterable[Effect], name: str, model: frozenset[str]) -> list[Effect]:
    """An effect and its further terms; of those that have to be bought the ones that a model has."""
    return [e for e in effects if name in (e.name, e.part_of) and (not e.bought or e.name in model)]


def step_of(time: FloatArray) -> float:
    """From one sample to the next of times (n,) of which most are equidistant, s; not a number for fewer than two."""
    if len(time) < 2:
        return float("nan")
    first, mean = float(time[1] - time[0]), float(time[-1] - time[0]) / (len(time) - 1)
    return mean if abs(first - mean) < UNIFORM * mean else float(np.median(np.diff(time)))


def nearest_axis(mounting: Mounting | None) -> int | None:
    """The sensor's axis that lies nearest to the rail."""
    along = None if mounting is None else mounting.along
    return None if along is None else int(np.argmax(np.abs(along)))


def along_sign(drivers: Drivers) -> float:
    """+1 or -1: whether the rail's direction points along or against the sensor's axis that is nearest to it.

    What the sensor itself makes of a motion turns with the board; its odd powers change sign.
    """
    along = None if drivers.mounting is None else drivers.mounting.along
    return 1.0 if along is None else float(np.sign(along[int(np.argmax(np.abs(along)))]))


def lacks_motion(drivers: Drivers) -> str | None:
    """The reason why an effect of the motion cannot be decided on a run."""
    return None if drivers.kinematics.velocity.any() else "no motion along a rail"


def lacks_direction(drivers: Drivers) -> str | None:
    """The same for an effect that also needs the rail's direction in the sensor's axes."""
    if drivers.mounting is None or drivers.mounting.sensor_from_rail is None:
        return lacks_motion(drivers) or "no accelerometer: the rail's direction in the sensor's axes is unknown"
    return lacks_motion(drivers)


def about_rail_axes(drivers: Drivers, driver: FloatArray) -> Mixed:
    """Design of a true rotation rate c_axis times one driver (n,) about each axis of the rail, shape (n, 3, 3)."""
    rotation = None if drivers.mounting is None else drivers.mounting.sensor_from_rail
    return Mixed(np.asarray(driver)[None], (np.zeros((3, 3)) if rotation is None else rotation)[None])


def per_axis(driver: FloatArray) -> Mixed:
    """Design of an effect that adds c_axis times one driver (n,) to each gyro axis, shape (n, 3, 3)."""
    return Mixed(np.asarray(driver)[None], np.eye(3)[None])


def spec(names: str, unit: str, plausible: float) -> tuple[ParameterSpec, ...]:
    """Parameters of one unit and plausible size, names separated by blanks."""
    return tuple(ParameterSpec(name, unit, plausible) for name in names.split())
