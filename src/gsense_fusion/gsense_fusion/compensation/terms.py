"""The terms that are subtracted from the angular rate: one small class an effect, named as in the catalogue.

A class holds the effect's parameters, reads and writes its entry of compensation.yaml, and gives the row of numbers
that the kernel works on. Adding a term touches its class, `TERMS`, and one branch of the kernel.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from .document import Matrix, Section, Vector

FloatArray = NDArray[np.float64]
ROW = 16
"""Numbers of one term in the kernel: 9 matrix, 3 direction, reference, lag or f0, damping, spare."""
KIND_FORCE, KIND_SQUARE, KIND_CUBE, KIND_JERK, KIND_RESONANCE = 0, 1, 2, 3, 4
KIND_TEMPERATURE, KIND_SUPPLY, KIND_FRICTION, KIND_SPEED, KIND_SCALE = 5, 6, 7, 8, 9


@dataclass(frozen=True)
class GSensitivity:
    """Rate that specific force makes: `matrix @ f`, rows gyro axes, columns accelerometer axes, (rad/s)/(m/s^2).

    `k` instead of a matrix is the thesis's equation 7.4: k [f_y, f_z, f_x].
    """

    effect: ClassVar[str] = "g_sensitivity"
    unit: ClassVar[str] = "(rad/s)/(m/s^2)"
    kind: ClassVar[int] = KIND_FORCE

    matrix: Matrix | None = None
    k: float | None = None

    def __post_init__(self) -> None:
        if (self.matrix is None) == (self.k is None):
            raise ValueError("g_sensitivity has either matrix or k")

    @property
    def full_matrix(self) -> Matrix:
        """The matrix, also where k is given."""
        if self.matrix is not None:
            return self.matrix
        k = float(self.k or 0.0)
        return ((0.0, k, 0.0), (0.0, 0.0, k), (k, 0.0, 0.0))

    @staticmethod
    def parse(section: Section) -> GSensitivity:
        """From its entry."""
        if section.has("matrix") == section.has("k"):
            raise ValueError(f"{section.path}matrix: give either matrix (3 rows of 3) or k")
        if section.has("k"):
            return GSensitivity(k=section.number("k"))
        return GSensitivity(matrix=section.matrix("matrix"))

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {"k": finite(self.k)} if self.k is not None else {"matrix": floats(self.full_matrix)}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return _row(matrix=self.full_matrix)


@dataclass(frozen=True)
class _ForceEffect:
    """What follows a function of the specific force: `c` times the component along `direction`, or a full matrix."""

    effect: ClassVar[str]
    unit: ClassVar[str]
    kind: ClassVar[int]

    c: Vector | None = None
    direction: Vector | None = None
    """Unit vector in the sensor's axes (the rail's direction in the mounting that was identified)."""
    matrix: Matrix | None = None

    def __post_init__(self) -> None:
        if (self.matrix is None) == (self.c is None) or (self.c is None) != (self.direction is None):
            raise ValueError(f"{self.effect} has either matrix, or c and direction")
        if self.direction is not None and abs(sum(x * x for x in self.direction) - 1.0) > 1e-3:
            raise ValueError(f"{self.effect}: direction has length 1")

    @classmethod
    def parse(cls, section: Section) -> Any:
        """From its entry."""
        if section.has("matrix") == section.has("c"):
            raise ValueError(f"{section.path}matrix: give either matrix (3 rows of 3), or c and direction")
        if section.has("matrix"):
            return cls(matrix=section.matrix("matrix"))
        return cls(c=section.vector("c"), direction=_direction(section))

    def document(self) -> dict[str, Any]:
        """Its entry."""
        if self.c is None or self.direction is None:
            return {"matrix": floats(self.matrix)}
        return {"c": floats(self.c), "direction": floats(self.direction)}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return _row(matrix=self.matrix) if self.c is None else _row(c=self.c, direction=self.direction)


@dataclass(frozen=True)
class GSquared(_ForceEffect):
    """`c (d.f)^2` (vibration rectification), or matrix @ [fx^2, fy^2, fz^2]."""

    effect: ClassVar[str] = "g_squared"
    unit: ClassVar[str] = "(rad/s)/(m/s^2)^2"
    kind: ClassVar[int] = KIND_SQUARE


@dataclass(frozen=True)
class GCubed(_ForceEffect):
    """`c (d.f)^3`, or matrix @ [fx^3, fy^3, fz^3]; with g_sensitivity and g_squared a polynomial of the third order."""

    effect: ClassVar[str] = "g_cubed"
    unit: ClassVar[str] = "(rad/s)/(m/s^2)^3"
    kind: ClassVar[int] = KIND_CUBE


@dataclass(frozen=True)
class JerkCoupling(_ForceEffect):
    """`c d(d.f)/dt`, or matrix @ df/dt; the derivative is the slope at the end of a parabola through the last 60 ms."""

    effect: ClassVar[str] = "jerk_coupling"
    unit: ClassVar[str] = "(rad/s)/(m/s^3)"
    kind: ClassVar[int] = KIND_JERK


@dataclass(frozen=True)
class GResonance:
    """`c y`, y'' + 2 damping w0 y' + w0^2 y = w0^2 (d.f): a mount that swings; static gain 1."""

    effect: ClassVar[str] = "g_resonance"
    unit: ClassVar[str] = "(rad/s)/(m/s^2)"
    kind: ClassVar[int] = KIND_RESONANCE

    c: Vector
    direction: Vector
    f0: float
    """Hz."""
    damping: float
    """Of the critical, between 0 and 1."""

    @staticmethod
    def parse(section: Section) -> GResonance:
        """From its entry."""
        f0, damping = section.number("f0"), section.number("damping")
        if not 0.0 < f0 < 1000.0:
            raise ValueError(f"{section.path}f0: {f0:g} Hz, must be between 0 and 1000")
        if not 0.0 < damping < 1.0:
            raise ValueError(f"{section.path}damping: {damping:g}, must be between 0 and 1")
        return GResonance(section.vector("c"), _direction(section), f0, damping)

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {
            "c": floats(self.c),
            "direction": floats(self.direction),
            "f0": finite(self.f0),
            "damping": finite(self.damping),
        }

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return _row(c=self.c, direction=self.direction, lag=self.f0, damping=self.damping)


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
        return _row(c=self.c, reference=self.reference, lag=self.lag_s)


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
        return _row(c=self.c, reference=self.reference)


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
        return _row(c=self.c)


@dataclass(frozen=True)
class FrictionPickup(_CarriageEffect):
    """`c sign(v)`: motor current that overcomes friction, picked up by the gyro's supply or wires."""

    effect: ClassVar[str] = "friction_pickup"
    unit: ClassVar[str] = "rad/s"
    kind: ClassVar[int] = KIND_FRICTION


@dataclass(frozen=True)
class SpeedPickup(_CarriageEffect):
    """`c v`: back-EMF, no true rotation."""

    effect: ClassVar[str] = "speed_pickup"
    unit: ClassVar[str] = "(rad/s)/(m/s)"
    kind: ClassVar[int] = KIND_SPEED


@dataclass(frozen=True)
class ScaleMisalignment:
    """The gyro shows (I + matrix) w: what is left of the rate at this place in the list is multiplied by its inverse.

    Groves, Principles of GNSS, Inertial, and Multisensor Integrated Navigation, equation 4.17; with g_sensitivity it is
    the 18-element calibration. Only true rotations show it.
    """

    effect: ClassVar[str] = "scale_misalignment"
    unit: ClassVar[str] = "1"
    kind: ClassVar[int] = KIND_SCALE

    matrix: Matrix

    def __post_init__(self) -> None:
        if np.abs(np.array(self.matrix)).sum(axis=1).max() > 0.5:
            raise ValueError("scale_misalignment: errors of more than 50 % are none of scale or alignment")

    @staticmethod
    def parse(section: Section) -> ScaleMisalignment:
        """From its entry."""
        return ScaleMisalignment(section.matrix("matrix"))

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {"matrix": floats(self.matrix)}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        inverse = np.linalg.inv(np.eye(3) + np.array(self.matrix))
        return _row(matrix=inverse)


Term = (
    GSensitivity
    | GSquared
    | GCubed
    | JerkCoupling
    | GResonance
    | TemperatureBias
    | SupplyVoltage
    | FrictionPickup
    | SpeedPickup
    | ScaleMisalignment
)
_KINDS: tuple[type[Term], ...] = (
    GSensitivity,
    GSquared,
    GCubed,
    JerkCoupling,
    GResonance,
    TemperatureBias,
    SupplyVoltage,
    FrictionPickup,
    SpeedPickup,
    ScaleMisalignment,
)
TERMS: dict[str, type[Term]] = {kind.effect: kind for kind in _KINDS}
"""Every term by the name of its effect."""


def parse_term(section: Section) -> Term:
    """One entry of `terms`.

    Raises:
        ValueError: an unknown effect, or keys or values that it cannot have.
    """
    effect = section.text("effect")
    if effect not in TERMS:
        raise ValueError(f"{section.path}effect: {effect!r} is not known; known: {', '.join(sorted(TERMS))}")
    kind = TERMS[effect]
    section.unit(kind.unit)
    try:
        term: Term = kind.parse(section)
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(section.path) else f"{section.path}{text}") from error
    section.no_others()
    return term


def term_document(term: Term) -> dict[str, Any]:
    """The entry of a term."""
    return {"effect": term.effect, **term.document(), "unit": term.unit}


def floats(values: Any) -> Any:
    """Numbers, or rows of them, as plain floats.

    Raises:
        ValueError: one is not finite.
    """
    return [floats(value) if isinstance(value, (tuple, list)) else finite(value) for value in values]


def finite(value: Any) -> float:
    """A plain float (numpy's are no YAML).

    Raises:
        ValueError: it is not finite.
    """
    value = float(value)
    if not isfinite(value):
        raise ValueError(f"a compensation file cannot hold {value}")
    return value


def _direction(section: Section) -> Vector:
    x, y, z = section.vector("direction")
    length = (x * x + y * y + z * z) ** 0.5
    if abs(length - 1.0) > 1e-3:
        raise ValueError(f"{section.path}direction: a unit vector is needed, this one has length {length:g}")
    return (x, y, z)


def _row(
    matrix: Matrix | FloatArray | None = None,
    c: Vector | None = None,
    direction: Vector | None = None,
    reference: float = 0.0,
    lag: float = 0.0,
    damping: float = 0.0,
) -> FloatArray:
    row = np.zeros(ROW)
    if matrix is not None:
        row[:9] = np.array(matrix, dtype=np.float64).ravel()
    elif c is not None:
        row[:3] = c
    if direction is not None:
        row[9:12] = direction
    row[12:15] = reference, lag, damping
    row[15] = 1.0 if direction is not None else 0.0
    return row
