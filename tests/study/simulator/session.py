"""A whole session: plan, physics, sampling; the truth stands beside the runs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter, lfilter_zi
from scipy.spatial.transform import Rotation

from gsense_fusion.bags.run import ImuSeries, LinkCounts, MagSeries, PoseSeries, Run, ScalarSeries

from . import disturbances as mechanisms
from .carriage import RATE_HZ, Travel, drive
from .magnetics import NEWTON_PER_AMPERE, magnetometer
from .markov import realise
from .parameters import ChainParameters, PlannedRun, SessionParameters, sweep_plan
from .rail import GRAVITY, Felt, Rail, make_rail, ride
from .thermal import Temperatures, thermometer, warm_up

Array = NDArray[np.float64]
EPOCH_NS = 1_750_000_000_000_000_000
SENSOR = "mpu6050"


@dataclass(frozen=True, eq=False)
class RunTruth:
    """One run's truth at the samples that arrived."""

    plan: PlannedRun
    time: Array
    """Session time of the samples in s, shape (n,)."""
    signal: Array
    """Angular rate as sampled, without noise and quantisation, rad/s, shape (n, 3)."""
    noise: Array
    """Measured minus signal, rad/s, shape (n, 3)."""
    drawn: Array
    """What of the signal no model can predict, since it is drawn at random, rad/s, shape (n, 3)."""
    earth: Array
    """Earth rate in the sensor's axes, rad/s, shape (3,)."""
    force: Array
    """True specific force as the gyro's filter passes it, m/s^2, shape (n, 3)."""
    travel: Travel


@dataclass(frozen=True, eq=False)
class Session:
    """Runs with their roles, and the truth."""

    parameters: SessionParameters
    runs: tuple[tuple[Run, str], ...]
    truth: tuple[RunTruth, ...]
    g_matrix: Array
    sensor_from_carriage: Array
    direction: Array
    """Unit vector along which the disturbances act, sensor axes."""
    rail_slope: Array
    """True rotation per metre about the rail's axes, rad/m, shape (3,)."""
    rail_bend: Array
    """rad/m^2, shape (3,)."""


@dataclass(frozen=True, eq=False)
class _World:
    p: SessionParameters
    rail: Rail
    mounting: Rotation
    g: Array
    direction: Array
    bias: Array
    friction: float
    temperatures: Temperatures
    starts: Array
    length_s: float
    accel: Array
    accel_bias: Array

    def size(self, kind: str) -> float:
        return sum(d.size for d in self.p.disturbances if d.kind == kind)


def simulate(parameters: SessionParameters) -> Session:
    """Simulate a session. The same seed with other disturbances gives the same noise, mounting and motion."""
    p = parameters
    plan = p.plan or sweep_plan(p.seed)
    world, slope, bend = _world(p, plan)
    noise_rng = np.random.default_rng([p.seed, 2])
    clocks = [_sample_times(p.chain, run, start, noise_rng) for run, start in zip(plan, world.starts, strict=True)]
    slow = np.stack([_slow_noise(p, np.concatenate(clocks), noise_rng) for _ in range(3)], axis=1)
    edges = np.cumsum([0] + [len(c) for c in clocks])
    runs, truth = [], []
    for i, run in enumerate(plan):
        made = _run(world, run, i, clocks[i], slow[edges[i] : edges[i + 1]])
        runs.append((made[0], run.role))
        truth.append(made[1])
    return Session(p, tuple(runs), tuple(truth), world.g, world.mounting.as_matrix(), world.direction, slope, bend)


def _world(p: SessionParameters, plan: tuple[PlannedRun, ...]) -> tuple[_World, Array, Array]:
    rng = np.random.default_rng([p.seed, 1])
    direction = rng.standard_normal(3)
    direction /= np.linalg.norm(direction)
    g = rng.normal(0, p.g_typical, (3, 3)) if p.g_matrix is None else np.array(p.g_matrix)
    size = sum(d.size for d in p.disturbances if d.kind == "rail_curvature")
    shape = rng.standard_normal(3)
    slope, bend = size * shape / np.linalg.norm(shape), size * rng.normal(0, 0.7, 3)
    rail = make_rail(rng, p.rail_shape, slope, bend)
    mounting = Rotation.from_rotvec(rng.normal(0, p.mounting_error, 3)) * Rotation.from_matrix(np.array(p.frame))
    starts = np.cumsum([0.0] + [r.duration_s + rng.uniform(3, 8) for r in plan])
    c = p.chain
    accel = Rotation.from_rotvec(rng.normal(0, c.accel_misalignment, 3)).as_matrix() * (
        1 + rng.normal(0, c.accel_scale, 3)
    )
    world = _World(
        p=p,
        rail=rail,
        mounting=mounting,
        g=g,
        direction=direction,
        bias=rng.normal(0, np.radians(1.5), 3),
        friction=float(rng.uniform(1.5, 4.0)) if p.seed % 2 else 2.5,
        temperatures=warm_up(p.thermal, float(starts[-1]), rng),
        starts=starts[:-1] + 1.0,
        length_s=float(starts[-1]),
        accel=accel,
        accel_bias=rng.normal(0, c.accel_bias, 3),
    )
    return world, slope, bend


def _sample_times(c: ChainParameters, run: PlannedRun, start: float, rng: np.random.Generator) -> Array:
    period = (1 + c.clock_ppm * 1e-6) / c.rate_hz
    first = start + 0.05 + rng.uniform(0, period)
    return first + np.arange(int((run.duration_s - 0.1) / period)) * period


def _slow_noise(p: SessionParameters, time: Array, rng: np.random.Generator) -> Array:
    n = p.noise
    relaxation = n.relaxation * rng.standard_normal() * np.exp(-(time + 20.0) / n.relaxation_tau_s)
    return realise(time, n.markov_tau_s, n.markov_sigma, rng) + relaxation


def _low_pass(series: Array, c: ChainParameters) -> Array:
    b, a, settled = _filter(c.filter_hz)
    return np.asarray(lfilter(b, a, series, axis=0, zi=settled[:, None] * series[:1])[0])


@lru_cache(maxsize=4)
def _filter(filter_hz: float) -> tuple[Array, Array, Array]:
    w = 2 * np.pi * filter_hz
    b, a = bilinear([w * w], [1.0, np.sqrt(2) * w, w * w], RATE_HZ)
    return b, a, lfilter_zi(b, a)


def _run(world: _World, run: PlannedRun, number: int, clock: Array, slow: Array) -> tuple[Run, RunTruth]:
    p, c = world.p, world.p.chain
    rng = np.random.default_rng([p.seed, 3, number])
    travel = drive(run, world.friction)
    felt = ride(world.rail, travel)
    turn = Rotation.from_rotvec([0.0, 0.0, np.deg2rad(180.0 * run.turned + run.turned_deg)])
    mounting = world.mounting * turn
    force, rate = mounting.apply(felt.force), mounting.apply(felt.rate)
    start = float(world.starts[number])
    time = start + travel.time
    scene = mechanisms.Scene(
        time, travel, world.temperatures.element_at(time) - 25.0, mounting.apply([1.0, 0.0, 0.0]), world.direction,
        world.length_s, _volts(world, time), _crept(world, time), np.random.default_rng([p.seed, 4, number]),
    )  # fmt: skip
    force, rate, drawn = _disturbed(world, scene, mounting, (force, rate))
    white = rng.standard_normal((len(time), 3)) * p.noise.white * np.sqrt(RATE_HZ / 2)
    late = clock - world.size("time_offset")
    signal = _at(late, time, _low_pass(rate, c))
    noise = _at(late, time, _low_pass(white, c)) + slow
    measured = np.round((signal + noise) / c.gyro_lsb) * c.gyro_lsb
    shake = rng.standard_normal((len(time), 3)) * c.accel_white * np.sqrt(RATE_HZ / 2)
    sensed = _at(clock, time, _low_pass(force @ world.accel.T + world.accel_bias + shake, c))
    sensed = np.round(sensed / c.accel_lsb) * c.accel_lsb
    kept = _arrived(len(clock), c.loss, rng)
    stamps = _stamp(p, clock + c.stamp_jitter_s * rng.standard_normal(len(clock)))
    mag, current = _magnetic(world, travel, mounting, start, number)
    imu = ImuSeries(stamps[kept], stamps[kept] + 2_000_000, measured[kept], sensed[kept], (True, True, True))
    bag = Run(
        path=Path(f"simulated/run_{number:02d}"),
        name=f"run_{number:02d}",
        sensor=SENSOR,
        topic=f"{SENSOR}/imu/data_raw",
        imu=imu,
        pose=_encoder(p, travel, start, rng),
        mag=mag,
        motor_current=current,
        battery=_battery(world, start, run.duration_s, rng),
        temperature=_thermometer(world, start, run.duration_s, rng) if p.temperature_topic else None,
        link=LinkCounts(int(kept.sum()), int((~kept).sum()), 0, 0, 0, 0),
    )
    passed, chance = (_at(late, time, _low_pass(series, c)) for series in (force, drawn))
    earth = mounting.apply(world.rail.level.inv().apply(world.rail.earth))
    return bag, RunTruth(
        run, clock[kept], signal[kept], (measured - signal)[kept], chance[kept], earth, passed[kept], travel
    )


def _disturbed(
    world: _World, scene: mechanisms.Scene, mounting: Rotation, felt: tuple[Array, Array]
) -> tuple[Array, Array, Array]:
    """Force, the rate that the gyro shows of it, and what of that rate is drawn at random."""
    force, rate = felt
    for d in world.p.disturbances:
        if d.kind in mechanisms.TURNS:
            angle = mounting.apply(mechanisms.TURNS[d.kind](scene, d.size))
            rate = rate + np.gradient(angle, 1.0 / RATE_HZ, axis=0)
            force = force - np.cross(angle, force)
    rate = rate + world.bias + force @ world.g.T
    drawn = np.zeros_like(rate)
    for d in world.p.disturbances:
        if d.kind in mechanisms.MECHANISMS:
            added = mechanisms.MECHANISMS[d.kind](scene, d.size)
            rate = rate + added
            drawn += added * (d.kind in mechanisms.RANDOM)
    return force, rate, drawn


def _at(when: Array, time: Array, series: Array) -> Array:
    return np.stack([np.interp(when, time, series[:, i]) for i in range(3)], axis=1)


def _stamp(p: SessionParameters, seconds: Array) -> NDArray[np.int64]:
    return EPOCH_NS + np.round((seconds + p.start_s) * 1e9).astype(np.int64)


def _arrived(n: int, loss: float, rng: np.random.Generator) -> NDArray[np.bool_]:
    kept = rng.random(n) >= loss * 0.75
    for first in np.flatnonzero(rng.random(n) < loss * 0.25 / 8):
        kept[first : first + 8] = False
    kept[[0, -1]] = True
    return kept


def _encoder(p: SessionParameters, travel: Travel, start: float, rng: np.random.Generator) -> PoseSeries:
    c = p.chain
    time = np.arange(rng.uniform(0, 1 / c.encoder_hz), travel.time[-1], 1 / c.encoder_hz)
    pulled = travel.acceleration / (2 * np.pi * c.belt_hz) ** 2
    position = (1.0 + c.encoder_scale) * np.interp(time, travel.time, travel.position + pulled)
    counted = np.round(position / c.encoder_quantum) * c.encoder_quantum
    return PoseSeries(_stamp(p, start + time + c.encoder_jitter_s * rng.standard_normal(len(time))), counted)


def _magnetic(
    world: _World, travel: Travel, mounting: Rotation, start: float, number: int
) -> tuple[MagSeries | None, ScalarSeries | None]:
    """Messages of the magnetometer, and the motor's current 50 times a second, where there are such."""
    p = world.p
    if p.magnetics is None:
        return None, None
    time, field = magnetometer(p.magnetics, travel, mounting, p.seed, number)
    mag = MagSeries(_stamp(p, start + time), field)
    if not p.magnetics.current_topic:
        return mag, None
    every = slice(None, None, round(RATE_HZ / 50))
    return mag, ScalarSeries(_stamp(p, start + travel.time[every]), travel.force[every] / NEWTON_PER_AMPERE)


def _volts(world: _World, time: Array) -> Array:
    """A cell that discharges, with the slow load changes of a radio: V over session time."""
    phase = float(world.p.seed % 97)
    sag = 0.012 * np.sin(2 * np.pi * time / 173.0 + phase) + 0.008 * np.sign(np.sin(2 * np.pi * time / 241.0 + phase))
    return np.asarray(4.0 - 0.1 * time / world.length_s + sag)


def _battery(world: _World, start: float, duration: float, rng: np.random.Generator) -> ScalarSeries:
    time = start + np.arange(0.1, duration, 1.0)
    volts = _volts(world, time) + 0.002 * rng.standard_normal(len(time))
    return ScalarSeries(_stamp(world.p, time), np.round(volts, 3))


def _crept(world: _World, time: Array) -> Array:
    """A random walk over the time that the motor has run, steps of 50 ms, from the session's seed alone."""
    grid = np.arange(0.0, world.length_s + 10.0, 0.05)
    runs = np.zeros(len(grid))
    for run, start in zip(world.p.plan or sweep_plan(world.p.seed), world.starts, strict=True):
        if run.angular_frequency > 0:
            runs += (grid > start + 2.0) & (grid < start + run.duration_s - 2.0)
    steps = np.random.default_rng([world.p.seed, 6]).standard_normal((len(grid), 3)) * np.sqrt(0.05 * runs)[:, None]
    return _at(time, grid, np.cumsum(steps, axis=0))


def _thermometer(world: _World, start: float, duration: float, rng: np.random.Generator) -> ScalarSeries:
    time = start + np.arange(0.03, duration, 1.0 / world.p.thermal.thermometer_hz)
    return ScalarSeries(_stamp(world.p, time), thermometer(world.p.thermal, world.temperatures, time, rng))


__all__ = ["GRAVITY", "Felt", "RunTruth", "Session", "simulate"]
