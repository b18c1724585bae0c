"""The rail as a curve in space and what a carriage on it feels: exact rotations, no small angles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from .carriage import RATE_HZ, Travel

Array = NDArray[np.float64]
GRAVITY = 9.81
EARTH_RATE = 7.292e-5
REACH = 0.4
UNEVEN = {"arc": (0.0, 0.1), "spline": (0.1, 0.1), "wavy": (0.5, 0.07)}
"""By shape: how much the slope between two knots differs from the arc's, and metres between them."""


@dataclass(frozen=True)
class Rail:
    """Attitude along the rail as a rotation vector (rail axes) over position, and how the whole rail lies."""

    turn: CubicSpline
    level: Rotation
    """From rail axes at s = 0 to the room (z up)."""
    earth: Array
    """Earth rate in the room's axes."""


@dataclass(frozen=True)
class Felt:
    """Carriage axes, each shape (n, 3)."""

    rate: Array
    force: Array


def make_rail(rng: np.random.Generator, shape: str, slope: Array, bend: Array) -> Rail:
    """A rail that turns by slope * s + bend * s^2 (rad, about its own axes), with uneven knots where it is a spline."""
    part, spacing = UNEVEN[shape]
    knots = spacing * np.arange(-round(REACH / spacing), round(REACH / spacing) + 1)
    uneven = 1.0 + part * rng.standard_normal((len(knots) - 1, 3))
    increments = np.diff(knots)[:, None] * (slope + 2 * bend * ((knots[1:] + knots[:-1]) / 2)[:, None]) * uneven
    angle = np.concatenate([np.zeros((1, 3)), np.cumsum(increments, axis=0)])
    turn = CubicSpline(knots, angle - angle[len(knots) // 2])
    level = Rotation.from_rotvec(np.radians(rng.normal(0, [0.2, 0.2, 40.0])))
    latitude = np.radians(50.0)
    return Rail(turn, level, EARTH_RATE * np.array([np.cos(latitude), 0.0, np.sin(latitude)]))


def ride(rail: Rail, travel: Travel) -> Felt:
    """Strapdown kinematics: rate from the rotation between instants, specific force from the true attitude."""
    attitude = Rotation.from_rotvec(rail.turn(travel.position))
    instant = np.arange(len(travel.position))
    before, after = attitude[np.maximum(instant - 1, 0)], attitude[np.minimum(instant + 1, instant[-1])]
    rate = (before.inv() * after).as_rotvec() * RATE_HZ / 2.0
    tangent = attitude.apply([1.0, 0.0, 0.0])
    ahead = Rotation.from_rotvec(rail.turn(travel.position + 1e-4)).apply([1.0, 0.0, 0.0])
    bend = (ahead - tangent) / 1e-4
    acceleration = tangent * travel.acceleration[:, None] + bend * (travel.velocity**2)[:, None]
    up = rail.level.inv().apply([0.0, 0.0, GRAVITY])
    force = attitude.inv().apply(acceleration + up)
    return Felt(rate + attitude.inv().apply(rail.level.inv().apply(rail.earth)), force)
