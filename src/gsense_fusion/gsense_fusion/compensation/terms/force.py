"""Terms that follow the specific force."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from gsense_fusion.compensation.document import Matrix, Section, Vector
from gsense_fusion.compensation.terms.numbers import (
    KIND_CUBE,
    KIND_FORCE,
    KIND_JERK,
    KIND_RESONANCE,
    KIND_SQUARE,
    FloatArray,
    as_row,
    finite,
    floats,
    unit_direction,
)

LONGEST_LAG_S = 0.06
"""Of a coupling: as far back as the parabola reaches."""


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
        return as_row(matrix=self.full_matrix)


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
        return cls(c=section.vector("c"), direction=unit_direction(section))

    def document(self) -> dict[str, Any]:
        """Its entry."""
        if self.c is None or self.direction is None:
            return {"matrix": floats(self.matrix)}
        return {"c": floats(self.c), "direction": floats(self.direction)}

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return as_row(matrix=self.matrix) if self.c is None else as_row(c=self.c, direction=self.direction)


@dataclass(frozen=True)
class _Power(_ForceEffect):
    """A power of the force along `direction`, and the next one of the same parity with the coefficients `higher`."""

    higher: Vector | None = None

    @classmethod
    def parse(cls, section: Section) -> Any:
        """From its entry."""
        if section.has("higher") and not section.has("c"):
            raise ValueError(f"{section.path}higher: stands beside c and direction only")
        term = super().parse(section)
        return replace(term, higher=section.vector("higher")) if section.has("higher") else term

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return super().document() | ({} if self.higher is None else {"higher": floats(self.higher)})

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return super().row() if self.c is None else as_row(c=self.c, rate=self.higher, direction=self.direction)


@dataclass(frozen=True)
class GSquared(_Power):
    """`c a^2 + higher a^4` (vibration rectification), a along the direction, or matrix @ [fx^2, fy^2, fz^2]."""

    effect: ClassVar[str] = "g_squared"
    unit: ClassVar[str] = "(rad/s)/(m/s^2)^2"
    kind: ClassVar[int] = KIND_SQUARE


@dataclass(frozen=True)
class GCubed(_Power):
    """`c a^3 + higher a^5`, a along the direction, or matrix @ [fx^3, fy^3, fz^3]."""

    effect: ClassVar[str] = "g_cubed"
    unit: ClassVar[str] = "(rad/s)/(m/s^2)^3"
    kind: ClassVar[int] = KIND_CUBE


@dataclass(frozen=True)
class JerkCoupling(_ForceEffect):
    """`c d(d.f)/dt`, or matrix @ df/dt, `lag_s` ago; the derivative is of a parabola through the last 60 ms."""

    effect: ClassVar[str] = "jerk_coupling"
    unit: ClassVar[str] = "(rad/s)/(m/s^3)"
    kind: ClassVar[int] = KIND_JERK

    lag_s: float = 0.0
    """How late the coupling is: what the mode behind it makes of a drive far below its frequency."""

    @classmethod
    def parse(cls, section: Section) -> JerkCoupling:
        """From its entry."""
        lag = section.number("lag_s", 0.0)
        if not 0.0 <= lag <= LONGEST_LAG_S:
            raise ValueError(f"{section.path}lag_s: {lag:g} s, must be between 0 and {LONGEST_LAG_S:g}")
        term: JerkCoupling = super().parse(section)
        return replace(term, lag_s=lag)

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return super().document() | ({"lag_s": finite(self.lag_s)} if self.lag_s else {})

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        row = super().row()
        row[13] = self.lag_s
        return row


@dataclass(frozen=True)
class GResonance:
    """`c y + rate y'`, y'' + 2 damping w0 y' + w0^2 y = w0^2 (d.f): a mount that swings and turns; static gain 1."""

    effect: ClassVar[str] = "g_resonance"
    unit: ClassVar[str] = "(rad/s)/(m/s^2)"
    kind: ClassVar[int] = KIND_RESONANCE

    c: Vector
    direction: Vector
    f0: float
    """Hz."""
    damping: float
    """Of the critical, between 0 and 1."""
    rate: Vector | None = None
    """Of a mount that truly turns, (rad/s)/(m/s^3); None where it does not."""

    @staticmethod
    def parse(section: Section) -> GResonance:
        """From its entry."""
        f0, damping = section.number("f0"), section.number("damping")
        if not 0.0 < f0 < 1000.0:
            raise ValueError(f"{section.path}f0: {f0:g} Hz, must be between 0 and 1000")
        if not 0.0 < damping < 1.0:
            raise ValueError(f"{section.path}damping: {damping:g}, must be between 0 and 1")
        rate = section.vector("rate") if section.has("rate") else None
        return GResonance(section.vector("c"), unit_direction(section), f0, damping, rate)

    def document(self) -> dict[str, Any]:
        """Its entry."""
        return {
            "c": floats(self.c),
            "direction": floats(self.direction),
            "f0": finite(self.f0),
            "damping": finite(self.damping),
            **({"rate": floats(self.rate)} if self.rate is not None else {}),
        }

    def row(self) -> FloatArray:
        """Its numbers for the kernel, shape (ROW,)."""
        return as_row(c=self.c, rate=self.rate, direction=self.direction, lag=self.f0, damping=self.damping)
