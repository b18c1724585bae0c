"""How the board sits on the carriage, and where on Earth the rail stands."""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from gsense_rig.sensors.constants import DEGREE, EARTH_RATE, LOCAL_GRAVITY

Array = npt.NDArray[np.float64]

_TURNS: dict[str, tuple[str, float]] = {
    "0": ("z", 0.0),
    "90": ("z", 90.0),
    "180": ("z", 180.0),
    "tilt_x": ("x", 90.0),
    "tilt_y": ("y", 90.0),
}
MOUNTINGS = tuple(_TURNS)
"""Names that a plan may use: degrees about the vertical, or on its side by 90 degrees about the rail's x or y axis."""


@dataclass(frozen=True)
class Mounting:
    """Orientation of the board on the carriage, with the small error that a person makes in screwing it on."""

    name: str = "0"
    seed: int = 0
    """Of the small misalignment; it is the same whenever this unit is mounted this way."""
    misalignment: float = 0.4 * DEGREE
    """Standard deviation about each axis, rad. 0 is an ideal mounting."""

    def __post_init__(self) -> None:
        if self.name not in _TURNS:
            raise ValueError(f"mounting {self.name!r} is unknown: use one of {', '.join(MOUNTINGS)}")

    def board_from_carriage(self) -> Array:
        """Rotation that takes a vector's components from the carriage's axes to the board's; shape (3, 3)."""
        axis, angle = _TURNS[self.name]
        ideal = Rotation.from_euler(axis, angle, degrees=True)
        rng = np.random.default_rng([self.seed, zlib.crc32(self.name.encode())])
        error = Rotation.from_rotvec(rng.normal(0.0, 1.0, 3) * self.misalignment)
        return np.asarray((ideal * error).inv().as_matrix(), dtype=np.float64)


@dataclass(frozen=True)
class Site:
    """Where the rail stands; the rail frame has x along the rail, z up."""

    latitude: float = 49.2 * DEGREE
    azimuth: float = 30.0 * DEGREE
    """Of the rail's x axis, from true north to the east."""
    gravity: float = LOCAL_GRAVITY
    earth_rate: float = EARTH_RATE
    """rad/s; 0 takes the Earth's rotation out."""
    field: float = 49e-6
    """Strength of the magnetic field, tesla."""
    dip: float = 66.0 * DEGREE
    """Of the field below the horizontal."""

    def gravity_reaction(self) -> Array:
        """Specific force at rest in the rail frame; shape (3,), m/s^2."""
        return np.array([0.0, 0.0, self.gravity])

    def rotation_rate(self) -> Array:
        """The Earth's in the rail frame; shape (3,), rad/s."""
        return self._from_north(self.earth_rate * math.cos(self.latitude), self.earth_rate * math.sin(self.latitude))

    def magnetic_field(self) -> Array:
        """In the rail frame; shape (3,), tesla."""
        return self._from_north(self.field * math.cos(self.dip), -self.field * math.sin(self.dip))

    def _from_north(self, north: float, up: float) -> Array:
        return np.array([north * math.cos(self.azimuth), north * math.sin(self.azimuth), up])
