"""A magnetometer on the carriage: the earth's field, magnetised steel beside the rail, the motor's leads."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .carriage import RATE_HZ, Travel
from .parameters import MagneticParameters

Array = NDArray[np.float64]
MU_0_OVER_4_PI = 1e-7
EARTH = np.array([9e-6, -17e-6, -44e-6])
"""T, rail axes: 19 uT horizontal, 44 uT down."""
NEWTON_PER_AMPERE = 11.0
LEADS = (np.array([0.0, 0.21, -0.05]), np.array([0.0, 0.22, -0.06]))
"""Where the two leads run along the rail, m; 1.2 m long."""
POLL_S = 0.01


def field_at(position: Array, current: Array, p: MagneticParameters, seed: int) -> Array:
    """Field in rail axes at carriage positions (n,) with the motor's current (n,), T, shape (n, 3)."""
    at = np.column_stack([position, np.zeros_like(position), np.zeros_like(position)])
    field = np.repeat(EARTH[None], len(at), axis=0)
    rng = np.random.default_rng([seed, 51])
    for x in (-0.31, -0.12, 0.05, 0.27):  # bolts and brackets, magnetised one way and the other
        moment = p.steel * rng.standard_normal(3)
        field = field + _dipole(at - np.array([x, rng.uniform(-0.2, 0.2), -0.18]), moment)
    for wire, sign in zip(LEADS, (1.0, -1.0), strict=True):
        field = field + sign * p.turns * current[:, None] * _wire(at - wire)
    return np.asarray(field)


def _dipole(r: Array, moment: Array) -> Array:
    """Of a point dipole of the moment in A m^2 at distances (n, 3) in m."""
    d = np.linalg.norm(r, axis=1, keepdims=True)
    return np.asarray(MU_0_OVER_4_PI * (3 * r * (r @ moment)[:, None] / d**5 - moment / d**3))


def _wire(r: Array) -> Array:
    """Of one ampere in a straight wire along x, 1.2 m long, by Biot and Savart, T, shape (n, 3)."""
    rho = np.hypot(r[:, 1], r[:, 2])
    ends = [(r[:, 0] + e) / np.hypot(r[:, 0] + e, rho) for e in (0.6, -0.6)]
    size = MU_0_OVER_4_PI / rho * (ends[0] - ends[1])
    return np.column_stack([np.zeros_like(rho), -r[:, 2] / rho * size, r[:, 1] / rho * size])


def magnetometer(
    p: MagneticParameters, travel: Travel, mounting: Rotation, seed: int, number: int
) -> tuple[Array, Array]:
    """Messages of a run: times in s since its start (k,) and fields in sensor axes, T (k, 3); one per new value."""
    rng = np.random.default_rng([seed, 5, number])
    true = field_at(travel.position, travel.force / NEWTON_PER_AMPERE, p, seed)
    width = round(p.average_s * RATE_HZ)
    kernel = np.ones(width) / width
    smooth = np.stack([np.convolve(np.pad(c, (width - 1, 0), mode="edge"), kernel, "valid") for c in true.T], axis=1)
    period = 1.0 / (p.rate_hz * (1.0 + rng.uniform(-0.01, 0.01)))
    measured_at = np.arange(rng.uniform(0.05, 0.05 + period), travel.time[-1] - 0.05, period)
    seen = np.stack([np.interp(measured_at, travel.time, c) for c in smooth.T], axis=1)
    hard_iron = np.random.default_rng([seed, 52]).normal(0, 15e-6, 3)
    sensed = mounting.apply(seen) + hard_iron + p.noise * rng.standard_normal(seen.shape)
    sensed = np.round(sensed / p.lsb) * p.lsb
    polled = np.ceil(measured_at / POLL_S) * POLL_S  # the register is read every 10 ms
    return polled, np.asarray(sensed)
