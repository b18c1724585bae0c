"""Hand-made results of every verdict for the tests of the report: small, with numbers that the tests can name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gsense_fusion.identification.errors.metrics import AttitudeTrace, Rms
from gsense_fusion.identification.result import (
    Ellipse,
    Finding,
    LoopResult,
    OrderSpectrum,
    Plots,
    PoseScatter,
    PositionMap,
    Ranked,
    RunErrors,
    RunSummary,
    SlowTrace,
    Unexplained,
)
from gsense_fusion.identification.types import Owner, Parameter

RAD = np.pi / 180.0
FIGURE_KEYS = ["per_run", "orders", "ellipse", "position", "slow", "spectrum", "poses", "attitude"]


def plots(samples: int = 400) -> Plots:
    """Every figure has data; deterministic."""
    rng = np.random.default_rng(5)
    phase = np.linspace(0, 2 * np.pi, 73)
    orders = np.arange(1, 21) / 2
    position = np.linspace(-0.15, 0.15, 20)
    sides = np.stack([np.ones((20, 3)), -np.ones((20, 3))]) * 1e-3
    sides[0, 3] = np.nan  # a bin without samples
    frequency = np.linspace(0.05, 100, 2000)
    time = np.arange(samples) / 200.0
    error = {m: k * np.abs(np.sin(time)) for m, k in (("raw", 0.02), ("declared", 0.01), ("full", 0.002))}
    blocks = rng.normal(size=(30, 3)) * 1e-4
    force = 9.8 * np.eye(3)[np.arange(12) % 3] * np.where(np.arange(12) % 2, 1.0, -1.0)[:, None]
    return Plots(
        per_run=tuple(RunErrors(f"run_{w}", w, 4e-3, 2e-3, 3e-4, 2.9e-4) for w in (3.0, 5.0)),
        orders=OrderSpectrum(orders, *(k * rng.uniform(0.5, 1.0, (20, 3)) for k in (1e-3, 2e-5, 2e-5))),
        ellipse=Ellipse("run_5", 5.0, "y", 3.75 * np.cos(phase), *(1e-3 * np.sin(phase + s) for s in (0.0, 0.2, 0.01))),
        position=PositionMap("run_5", position, sides, 0.05 * sides),
        slow=SlowTrace(np.arange(30) * 20.0, blocks, 0 * blocks, 0.5 * blocks, np.linspace(22, 27, 30)),
        poses=PoseScatter(force, *(k * force[:, [1, 2, 0]] for k in (1e-4, 9e-5, 1e-6))),
        attitude=AttitudeTrace("run_5", time, error, error),
        spectrum_hz=frequency,
        spectrum={m: k / np.sqrt(1 + frequency) for m, k in (("declared", 3e-4), ("full", 1e-4), ("noise", 1e-4))},
    )


def runs() -> tuple[RunSummary, ...]:
    """One at rest, one fitted, one held out."""
    return (
        RunSummary("/data/run_00", "fit", 8000, 0, 200.0, 0, None, None, None),
        RunSummary("/data/run_01", "fit", 6000, 3, 200.0, 0, 3.0, 0.15, 0.0051),
        RunSummary("/data/run_02", "held_out", 6000, 1, 200.0, 1, 5.0, 0.15, 0.0049),
    )


def rail() -> Finding:
    """0.130 +- 0.004 deg/m (95 %) on y."""
    parameters = {
        "t_x": Parameter(1e-6, 3e-5, "rad/m"),
        "t_y": Parameter(0.130 * RAD, 0.004 * RAD / 1.959964, "rad/m"),
        "u_y": Parameter(1e-6, 3e-5, "rad/m^2"),
    }
    return Finding(
        "rail_curvature", Owner.RIG, ("y",), parameters, 1e-40, 2e-3, 3e-4, ("speed_pickup",), "board_turned_180",
        "R (t + 2 u s) v", "geometry of a bowed rail",
    )  # fmt: skip


def delay() -> Finding:
    """tau = 20.0 +- 0.5 ms."""
    return Finding(
        "time_offset",
        Owner.CHAIN,
        ("x", "z"),
        {"tau": Parameter(0.020, 0.0005 / 1.959964, "s")},
        3e-5,
        3e-4,
        2e-4,
        (),
        None,
    )


def unexplained() -> Unexplained:
    """At 2.00 Hz, 0.022 deg/s."""
    return Unexplained(("x", "y"), 0.022 * RAD, "locked to the drive at order 2", (4 * np.pi,), ("g_cubed",))


def nothing_missing() -> LoopResult:
    """All figures, no finding; errors below 5 Hz 0.0467, 0.0205 and 0.0200 deg/s."""
    g = {
        f"g_{r}{c}": Parameter(1e-4 if r != c else 1e-6, 1e-6 if c != "z" else 1e-3, "(rad/s)/(m/s^2)")
        for r in "xyz"
        for c in "xyz"
    }
    bias = {f"b_{x}": Parameter(0.01, 1e-5, "rad/s") for x in "xyz"}
    return LoopResult(
        sensor="mpu6050",
        unit_id=None,
        declared=("bias", "g_sensitivity"),
        declared_parameters={"bias": bias, "g_sensitivity": g},
        runs=runs(),
        findings=(),
        unexplained=None,
        rate_rms=Rms(0.0467 * RAD, 0.0205 * RAD, 0.0205 * RAD, 0.0200 * RAD),
        pose_rms=None,
        attitude_gyro_only=Rms(0.01, 0.005, 0.005),
        attitude_madgwick=Rms(0.03, 0.02, 0.02),
        bias=(0.01, 0.01, 0.01),
        g_matrix=None,
        temperature_reference=25.0,
        undecided=("gyro scale cannot be seen",),
        notes=("a note",),
        ranking=(Ranked(("g_sensitivity",), 0.0, 0.0), Ranked(("g_sensitivity", "time_offset"), 11.3, -0.02)),
        plots=plots(),
    )


def effects_found() -> LoopResult:
    """A bent rail; errors below 5 Hz fall from 0.0372 to 0.0205 deg/s."""
    rate = Rms(0.0467 * RAD, 0.0372 * RAD, 0.0205 * RAD, 0.0200 * RAD)
    return replace(nothing_missing(), findings=(rail(),), rate_rms=rate)


def partly_unexplained() -> LoopResult:
    """A bent rail, and something else."""
    return replace(effects_found(), unexplained=unexplained())


def only_unexplained() -> LoopResult:
    """Nothing but something that the catalogue does not have."""
    return replace(nothing_missing(), unexplained=unexplained())


def still_poses() -> LoopResult:
    """One bag of still stretches, no rig, no plots of motion: means at rest fall from 0.0701 to 0.0221 deg/s."""
    g = {f"g_{r}{c}": Parameter(2e-4, 1e-5, "(rad/s)/(m/s^2)") for r in "xyz" for c in "xyz"}
    finding = Finding("g_sensitivity", Owner.SENSOR, ("x", "y", "z"), g, 1e-40, 1.2e-3, 3.5e-4, (), None)
    everything = plots()
    return replace(
        nothing_missing(),
        sensor="xsens",
        declared=("bias",),
        declared_parameters={},
        runs=(RunSummary("/data/poses", "fit", 26200, 0, 100.0, 0, None, None, None),),
        findings=(finding,),
        rate_rms=Rms(2e-3, 2e-3, 1.9e-3, 1.9e-3),
        pose_rms=Rms(0.0701 * RAD, 0.0701 * RAD, 0.0221 * RAD, 0.0151 * RAD),
        plots=Plots(per_run=everything.per_run, poses=everything.poses, attitude=everything.attitude),
    )


ALL = {
    "nothing_missing": nothing_missing,
    "effects_found": effects_found,
    "partly_unexplained": partly_unexplained,
    "only_unexplained": only_unexplained,
    "still_poses": still_poses,
}
