"""A board put down in many poses, simulated: no rail, quick turns by hand between the poses, truth beside it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation, Slerp

from gsense_fusion.bags.run import ImuSeries, MagSeries, Run

from .simulator.markov import realise
from .simulator.parameters import DEG, NoiseParameters

Array = NDArray[np.float64]
EPOCH_NS = 1_750_000_000_000_000_000
GRAVITY = 9.80665


@dataclass(frozen=True)
class PoseParameters:
    """A session of still poses; everything random follows `seed`."""

    seed: int = 0
    poses: int = 20
    still_s: float = 8.0
    turn_s: float = 2.0
    rate_hz: float = 100.0
    g_typical: float = 0.1 * DEG / GRAVITY
    """Standard deviation of G's elements, (rad/s)/(m/s^2)."""
    cyclic: bool = False
    """G is k of equation 7.4."""
    bias: float = 1.0 * DEG
    accel_white: float = 4e-3
    """m/s^2/sqrt(Hz)."""
    accel_scale: float = 0.01
    accel_bias: float = 0.1
    gyro_scale: float = 0.0
    """Standard deviation of the elements of M in (I + M) w."""
    mag_noise: float = 3e-7
    """T, of a sample."""
    latitude_deg: float = 50.0
    noise: NoiseParameters = field(default_factory=NoiseParameters)


@dataclass(frozen=True, eq=False)
class PoseSession:
    """One bag's content and the truth."""

    run: Run
    g: Array
    bias: Array
    """Constant part, rad/s."""
    drift: Array
    """What the bias does beside, rad/s, shape (n, 3)."""
    accel_shape: Array
    """true force = shape (f - bias)."""
    accel_bias: Array
    gyro_matrix: Array
    """M of (I + M) w."""
    hard_iron: Array
    soft_iron: Array


def simulate_poses(p: PoseParameters) -> PoseSession:
    """Simulate a session."""
    rng = np.random.default_rng([p.seed, 77])
    time, orientation = _motion(p, rng)
    true_rate = _rate(time, orientation) + orientation.inv().apply(_earth_rate(p.latitude_deg))
    true_force = orientation.inv().apply([0.0, 0.0, GRAVITY])
    k = rng.normal() * p.g_typical
    g = np.array([[0, k, 0], [0, 0, k], [k, 0, 0]]) if p.cyclic else rng.normal(size=(3, 3)) * p.g_typical
    bias = rng.normal(size=3) * p.bias
    matrix = rng.normal(size=(3, 3)) * p.gyro_scale
    shape = np.eye(3) + np.tril(rng.normal(size=(3, 3))) * p.accel_scale
    accel_bias = rng.normal(size=3) * p.accel_bias
    root = np.sqrt(p.rate_hz / 2)
    n = p.noise
    slow = np.stack([realise(time, n.markov_tau_s, n.markov_sigma, rng) for _ in range(3)], axis=1)
    force = true_force @ np.linalg.inv(shape).T + accel_bias
    rate = true_rate @ (np.eye(3) + matrix).T + true_force @ g.T + bias + slow
    rate = rate + n.white * root * rng.normal(size=rate.shape)
    force = force + p.accel_white * root * rng.normal(size=force.shape)
    stamp = EPOCH_NS + np.rint(time * 1e9).astype(np.int64)
    imu = ImuSeries(stamp, stamp, rate, force, (True, True, True))
    hard, soft, mag = _field(p, rng, stamp, orientation)
    run = Run(Path(f"poses_{p.seed}"), f"poses_{p.seed}", "mpu6050", "/mpu6050/imu/data_raw", imu, mag=mag)
    return PoseSession(run, g, bias, slow, shape, accel_bias, matrix, hard, soft)


def _motion(p: PoseParameters, rng: np.random.Generator) -> tuple[Array, Rotation]:
    """Poses spread over the sphere in random order, each held, smooth turns between."""
    stops = Rotation.random(p.poses, random_state=rng)
    unit = p.still_s + p.turn_s
    n = round((p.poses * unit - p.turn_s) * p.rate_hz)
    time = np.arange(n) / p.rate_hz
    number = np.minimum((time // unit).astype(int), p.poses - 1)
    part = np.clip((time - number * unit - p.still_s) / p.turn_s, 0.0, 1.0)
    smooth = part * part * part * (10 + part * (6 * part - 15))
    slerp = Slerp(np.arange(p.poses), stops)
    return time, slerp(np.minimum(number + smooth, p.poses - 1))


def _rate(time: Array, orientation: Rotation) -> Array:
    """Mean rate over each interval that ends at a sample, body axes, shape (n, 3)."""
    step = (orientation[:-1].inv() * orientation[1:]).as_rotvec() / np.diff(time)[:, None]
    return np.concatenate([step[:1], step])


def _earth_rate(latitude_deg: float) -> Array:
    """East, north, up; the poses' headings are random."""
    latitude = np.radians(latitude_deg)
    return 7.292115e-5 * np.array([0.0, np.cos(latitude), np.sin(latitude)])


def _field(
    p: PoseParameters, rng: np.random.Generator, stamp: NDArray[np.int64], orientation: Rotation
) -> tuple[Array, Array, MagSeries]:
    every = round(p.rate_hz / 20)
    earth = np.array([0.0, 2.0e-5, -4.4e-5])
    skew = rng.normal(size=(3, 3)) * 0.03
    soft = np.eye(3) + (skew + skew.T) / 2
    soft /= np.cbrt(np.linalg.det(soft))
    hard = rng.normal(size=3) * 2e-5
    true = orientation[::every].inv().apply(earth)
    measured = true @ np.linalg.inv(soft).T + hard + p.mag_noise * rng.normal(size=true.shape)
    return hard, soft, MagSeries(stamp[::every], measured)
