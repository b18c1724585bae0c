"""Hand-made reports of one unit: what the tests of the comparison start from."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tests.fusion import report_results as made

from gsense_fusion.comparison.snapshot import Snapshot, snapshot
from gsense_fusion.identification.result import Covariance, LoopResult, RunSummary
from gsense_fusion.identification.types import Parameter
from gsense_fusion.report.document import report_document

G_UNIT = "(rad/s)/(m/s^2)"
NAMES = tuple(f"g_{r}{c}" for r in "xyz" for c in "xyz")
PLAUSIBLE = 1.7e-4
"""(rad/s)/(m/s^2), 0.1 deg/s/g."""
PRECISION = 1.5e-6
RNG = np.random.default_rng
TRUE_G = PLAUSIBLE * RNG(3).standard_normal((3, 3))


def along(angle: float) -> np.ndarray:
    """The rail's direction in the sensor's axes, off x by some radians."""
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def one_mounting(seed: int, g: np.ndarray = TRUE_G, angle: float = 0.0) -> tuple[np.ndarray, Covariance]:
    """G (9,) as a session with one mounting finds it: along the motion alone, with its covariance."""
    u = along(angle)
    seen = g @ u + PRECISION * RNG([seed, 8]).standard_normal(3)
    open_ = PLAUSIBLE**2 * (np.eye(3) - np.outer(u, u)) + PRECISION**2 * np.outer(u, u)
    return np.outer(seen, u).ravel(), Covariance(NAMES, np.kron(np.eye(3), open_), np.full(9, PLAUSIBLE))


def result(seed: int, g: np.ndarray = TRUE_G, angle: float = 0.0, unit_id: str | None = "A17") -> LoopResult:
    """Of a session in which nothing is missing."""
    r = RNG([seed, 9])
    values, spread = one_mounting(seed, g, angle)
    stderr = np.sqrt(np.diag(spread.matrix))
    parameters = {n: Parameter(float(v), float(s), G_UNIT) for n, v, s in zip(NAMES, values, stderr, strict=True)}
    bias = {f"b_{x}": Parameter(float(r.normal(0, 0.02)), 1e-5, "rad/s") for x in "xyz"}
    pickup = {f"c_{x}": Parameter(float(r.normal(0, 1e-5)), 1e-5, "(rad/s)/(m/s)") for x in "xyz"}
    rail = {f"t_{x}": Parameter(float(r.normal(0, 3e-5)), 3e-5, "rad/m") for x in "xyz"}
    diagonal = {
        name: Covariance(tuple(p), np.diag([q.stderr**2 for q in p.values()]), np.full(3, 2e-3))
        for name, p in (("speed_pickup", pickup), ("rail_curvature", rail))
    }
    noise = {x: Parameter(9e-5 * (1 + 0.01 * r.standard_normal()), 9e-7, "(rad/s)/sqrt(Hz)") for x in "xyz"}
    runs = tuple(RunSummary(f"/data/{seed}/{n}", "fit", 6000, 0, 200.0, 0, 3.0 + n, 0.15, 5.1e-3) for n in range(4))
    return replace(
        made.nothing_missing(),
        unit_id=unit_id,
        declared_parameters={"bias": bias, "g_sensitivity": parameters},
        runs=runs,
        covariances={"g_sensitivity": spread, **diagonal},
        not_found={"speed_pickup": pickup, "rail_curvature": rail},
        encoder_delay=Parameter(5.1e-3 + r.normal(0, 5e-5), 5e-5, "s"),
        rest_noise=noise,
    )


def with_rail(seed: int, t_y: float = 2.3e-3, alternatives: tuple[str, ...] = ()) -> LoopResult:
    """The same with a bent rail."""
    plain = result(seed)
    parameters = {f"t_{x}": Parameter(t_y if x == "y" else 0.0, 3e-5, "rad/m") for x in "xyz"}
    finding = replace(made.rail(), parameters=parameters, alternatives=alternatives)
    return replace(plain, findings=(finding,), not_found={"speed_pickup": plain.not_found["speed_pickup"]})


def shot(r: LoopResult, path: str = "report.json") -> Snapshot:
    """A result as the comparison reads it."""
    return snapshot(report_document(r), path)
