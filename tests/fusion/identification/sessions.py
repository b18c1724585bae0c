"""Short simulated sessions for the tests, each simulated and analysed once."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from tests.study.judge import analyse
from tests.study.simulator import Disturbance, PlannedRun, Session, SessionParameters, simulate
from tests.study.simulator.parameters import DEG, ChainParameters, ThermalParameters

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.engine import Settings
from gsense_fusion.identification.result import Finding, LoopResult

SETTINGS = Settings("mpu6050")
SHORT = (
    PlannedRun(5.0, 16.0),
    PlannedRun(0.0, 45.0),
    PlannedRun(3.1, 16.0, role="held_out"),
    PlannedRun(8.0, 16.0),
    PlannedRun(2.6, 16.0),
    PlannedRun(5.7, 16.0, role="held_out"),
    PlannedRun(6.5, 16.0),
    PlannedRun(3.5, 16.0),
)
G_DEG_S_G = ((0.10, 0.03, -0.05), (-0.12, 0.02, 0.08), (0.07, -0.09, 0.04))
G = tuple(tuple(x * DEG / 9.80665 for x in row) for row in G_DEG_S_G)
BASE = SessionParameters(
    seed=11,
    plan=SHORT,
    g_matrix=G,
    thermal=ThermalParameters(warm_for_s=5.0),
    chain=ChainParameters(rate_hz=62.5, filter_hz=20.0),
)

TEMPERATURE = Disturbance("temperature_bias", 0.05 * DEG)
"""rad/s/K; the datasheet's worst case is three times that."""
BOW = Disturbance("rail_curvature", 0.13 * DEG)
"""rad/m: 0.1 mm of sag on 0.6 m."""
LATE = Disturbance("time_offset", 0.040)
"""s: a FIFO of some samples (typical: 0.4 to 40 ms)."""


@lru_cache(maxsize=32)
def made(*disturbances: Disturbance, base: SessionParameters = BASE) -> Session:
    return simulate(replace(base, disturbances=disturbances))


@lru_cache(maxsize=64)
def analysed(*disturbances: Disturbance, base: SessionParameters = BASE) -> LoopResult:
    return analyse(made(*disturbances, base=base), SETTINGS)


def names(result: LoopResult) -> list[str]:
    return sorted(f.effect for f in result.findings)


def finding(result: LoopResult, effect: str) -> Finding:
    found = [f for f in result.findings if f.effect == effect]
    assert found, f"{effect} not found: {result.verdict}, {names(result)}, {result.unexplained}"
    return found[0]


def changed(session: Session, change: object) -> Session:
    """The session with every run passed through `change(run, role) -> (run, role)`."""
    return replace(session, runs=tuple(change(run, role) for run, role in session.runs))  # type: ignore[operator]


def in_axes(run: Run, rotation: np.ndarray) -> Run:
    """The run as a sensor with other axes would have recorded it."""
    imu = replace(
        run.imu, angular_rate=run.imu.angular_rate @ rotation.T, specific_force=run.imu.specific_force @ rotation.T
    )
    return replace(run, imu=imu)
