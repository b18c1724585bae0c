"""Forms of g-compensation beside the full G, as effects of the identification: fitted and judged by its machinery."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Effect, spec
from gsense_fusion.identification.effects.g_sensitivity import GSensitivity
from gsense_fusion.identification.types import GRAVITY, FloatArray, Owner


class CyclicK(Effect):
    """The thesis's one number: k [f_y, f_z, f_x]."""

    name = "cyclic_k"
    slow = True
    owner = Owner.SENSOR
    equation = "k [f_y, f_z, f_x]"
    source = "thesis eq. 7.4"
    parameters = spec("k", "(rad/s)/(m/s^2)", 3e-4)

    def missing(self, drivers: Drivers) -> str | None:
        """It needs the accelerometer."""
        return "no accelerometer" if drivers.specific_force is None else None

    def design(self, drivers: Drivers) -> FloatArray:
        """One column, shape (n, 3, 1)."""
        force = drivers.specific_force
        return np.zeros((len(drivers), 3, 1)) if force is None else force[:, [1, 2, 0], None]


class _Powers(Effect):
    """Powers of each component of the specific force through a full matrix."""

    power: int

    def missing(self, drivers: Drivers) -> str | None:
        """It needs the accelerometer."""
        return "no accelerometer" if drivers.specific_force is None else None

    def design(self, drivers: Drivers) -> FloatArray:
        """Row i of the matrix times the powers, shape (n, 3, 9)."""
        out = np.zeros((len(drivers), 3, 9))
        if drivers.specific_force is not None:
            for axis in range(3):
                out[:, axis, 3 * axis : 3 * axis + 3] = drivers.specific_force**self.power
        return out


class Squares(_Powers):
    """matrix @ [f_x^2, f_y^2, f_z^2]: with G the thesis's 18 numbers, read one way."""

    name = "squares"
    slow = True
    owner = Owner.SENSOR
    equation = "M [f_x^2, f_y^2, f_z^2]"
    source = "IEEE Std 1431; Groves ch. 4"
    parameters = spec("s_xx s_xy s_xz s_yx s_yy s_yz s_zx s_zy s_zz", "(rad/s)/(m/s^2)^2", 1e-5)
    power = 2


class Cubes(_Powers):
    """matrix @ [f_x^3, f_y^3, f_z^3]: with G and the squares a polynomial of the third order."""

    name = "cubes"
    slow = True
    owner = Owner.SENSOR
    equation = "M [f_x^3, f_y^3, f_z^3]"
    source = "the thesis's proposal of a higher order"
    parameters = spec("q_xx q_xy q_xz q_yx q_yy q_yz q_zx q_zy q_zz", "(rad/s)/(m/s^2)^3", 1e-6)
    power = 3


class EarthVertical(Effect):
    """The earth's turn about the vertical where the latitude is not known: along the specific force of still poses."""

    name = "earth_vertical"
    owner = Owner.REFERENCE
    equation = "e f / g"
    source = "thesis eq. 2.1"
    parameters = spec("e", "rad/s", 7e-5)
    dynamic = False
    slow = True

    def missing(self, drivers: Drivers) -> str | None:
        """It needs the accelerometer."""
        return "no accelerometer" if drivers.specific_force is None else None

    def design(self, drivers: Drivers) -> FloatArray:
        """One column, shape (n, 3, 1)."""
        force = drivers.specific_force
        return np.zeros((len(drivers), 3, 1)) if force is None else force[:, :, None] / GRAVITY


EFFECTS: tuple[Effect, ...] = (CyclicK(), GSensitivity(), Squares(), Cubes(), EarthVertical())
VARIANTS: dict[str, frozenset[str]] = {
    "none": frozenset(),
    "k": frozenset({"cyclic_k"}),
    "matrix": frozenset({"g_sensitivity"}),
    "matrix_squares": frozenset({"g_sensitivity", "squares"}),
    "polynomial": frozenset({"g_sensitivity", "squares", "cubes"}),
}
"""The effects of each variant."""
SAME = {"squares": "g_squared", "cubes": "g_cubed"}
"""Effects of the catalogue that are part of those of a variant: not beside them."""
WITH_SCALE = {"groves": "matrix", "groves_squares": "matrix_squares"}
"""Variants with scale and misalignment beside (from true turns: `turns`), and what they are without."""
