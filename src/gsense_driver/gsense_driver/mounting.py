"""Axes of a sensor as a signed permutation, written like "x y z" (identity) or "-y x z"."""

from __future__ import annotations

from typing import NamedTuple

from gsense_driver.errors import SettingError

Vector = tuple[float, float, float]


class Mounting(NamedTuple):
    """Output axis i is `signs[i]` times the sensor's axis `axes[i]`."""

    axes: tuple[int, int, int] = (0, 1, 2)
    signs: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def identity(self) -> bool:
        """True where nothing is to be done."""
        return self == Mounting()

    def apply(self, v: Vector) -> Vector:
        """Rotate a vector from the sensor's axes."""
        (i, j, k), (a, b, c) = self
        return a * v[i], b * v[j], c * v[k]

    def apply_variances(self, v: Vector) -> Vector:
        """Variances follow their axes without the signs."""
        i, j, k = self.axes
        return v[i], v[j], v[k]


def parse_mounting(text: str, name: str = "mounting") -> Mounting:
    """Parse a mounting; raises SettingError where it is no proper rotation."""
    words = text.split()
    letters = [word.lstrip("+-") for word in words]
    if sorted(letters) != ["x", "y", "z"] or any(len(word) > 2 for word in words):
        raise SettingError(f"{name}: '{text}' is not three signed axes such as 'x y z' or '-y x z'")
    axes = ["xyz".index(letter) for letter in letters]
    signs = [-1.0 if word.startswith("-") else 1.0 for word in words]
    inversions = sum(axes[i] > axes[j] for i in range(3) for j in range(i + 1, 3))
    if (-1.0) ** inversions * signs[0] * signs[1] * signs[2] < 0:
        raise SettingError(f"{name}: '{text}' is a mirror image, not a rotation; turn one sign over")
    return Mounting((axes[0], axes[1], axes[2]), (signs[0], signs[1], signs[2]))
