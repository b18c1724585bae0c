"""Do the calibration's 95 % intervals hold the truth? Many simulated sessions, still poses and sweeps.

    ./rig exec python tests/study/calibration.py [--poses 100] [--sweeps 30] [--nulls 100] [--first-seed 0]

Prints for each kind of parameter the part of intervals (value +- 1.96 stderr) that hold the truth, what was refused,
and the false alarms on sensors without g-sensitivity. Exit 1 where a coverage is outside 90 to 98 % by more than chance
allows.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

import numpy as np  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.progress import Progress  # noqa: E402
from rich.table import Table  # noqa: E402
from scipy.stats import binom  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.study.poses import PoseParameters, PoseSession, simulate_poses  # noqa: E402
from tests.study.simulator import SessionParameters, simulate  # noqa: E402
from tests.study.simulator.parameters import ChainParameters, sweep_plan  # noqa: E402

from gsense_fusion.bags.run import ImuSeries, Run  # noqa: E402
from gsense_fusion.calibration.accelerometer import (  # noqa: E402
    AccelerometerCalibration,
    calibrate_accelerometer,
    pose_means,
)
from gsense_fusion.calibration.gyro import GyroCalibration, calibrate_gyro  # noqa: E402
from gsense_fusion.calibration.magnetometer import MagnetometerCalibration, calibrate_magnetometer  # noqa: E402
from gsense_fusion.calibration.turns import ScaleCalibration, calibrate_scale, find_turns  # noqa: E402
from gsense_fusion.identification.analysis import Analysis  # noqa: E402
from gsense_fusion.identification.motion.earth import Site  # noqa: E402
from gsense_fusion.identification.types import Role  # noqa: E402

HELD_OUT_PART = 0.15
Scores = dict[str, list[float]]


def main() -> int:
    a = _arguments()
    scores: Scores = {}
    refusals: Counter[str] = Counter()
    alarms = 0
    with Progress(console=Console(stderr=True)) as bar:
        for seed in bar.track(range(a.first_seed, a.first_seed + a.poses), description="poses"):
            _poses(seed, scores, refusals)
        for seed in bar.track(range(a.first_seed, a.first_seed + a.sweeps), description="sweeps"):
            _sweep(seed, scores)
        for seed in bar.track(range(a.first_seed, a.first_seed + a.nulls), description="nulls"):
            alarms += _null(seed)
    bad = show(scores)
    for words, number in refusals.most_common():
        print(f"refused in {number} of {a.poses}: {words}")
    if a.nulls:
        print(f"called significant without g-sensitivity: {alarms} of {a.nulls}")
    return 1 if bad else 0


def show(scores: Scores) -> bool:
    table = Table("intervals of", "number", "hold the truth", "rms of (estimate - truth)/stderr")
    bad = False
    for name, z in scores.items():
        n, inside = len(z), int(np.sum(np.abs(z) < 1.96))
        low, high = binom.ppf(0.005, n, 0.90), binom.ppf(0.995, n, 0.98)
        outside = not low <= inside <= high
        bad |= outside
        part = f"{100 * inside / n:.1f} %" + (" !" if outside else "")
        table.add_row(name, str(n), part, f"{np.sqrt(np.mean(np.square(z))):.2f}")
    Console(width=100).print(table)
    return bad


def _poses(seed: int, scores: Scores, refusals: Counter[str]) -> None:
    cyclic = seed % 2 == 0
    site = Site(50.0) if seed % 6 < 2 else None
    s = simulate_poses(PoseParameters(seed=seed, cyclic=cyclic, gyro_scale=0.005))
    found, analysis = calibrate_gyro(_split(s.run), "mpu6050", site=site)
    # G and bias as the measured specific force sees them: G f = G A (f_m - b_a)
    g = s.g @ s.accel_shape
    _add(
        scores,
        "G, poses" + ("" if site is None else " at a known latitude"),
        found.g_sensitivity.value - g,
        found.g_sensitivity.stderr,
    )
    # the bias of the fitted part of the session: what the drift was there in the mean belongs to it
    drift = s.drift[: round(len(s.drift) * (1 - HELD_OUT_PART))].mean(axis=0)
    _add(scores, "bias, poses", found.bias.value - (s.bias + drift - g @ s.accel_bias), found.bias.stderr)
    if cyclic:
        _add(
            scores,
            "k, poses" + ("" if site is None else " at a known latitude"),
            found.k.value - np.mean([g[0, 1], g[1, 2], g[2, 0]]),
            found.k.stderr,
        )
    _triads(s, found, analysis, scores, refusals)


def _triads(s: PoseSession, found: GyroCalibration, analysis: Analysis, scores: Scores, refusals: Counter[str]) -> None:
    """Accelerometer, scale of the gyro, magnetometer."""
    accelerometer = calibrate_accelerometer(pose_means(analysis.campaign.fit))
    correction = None
    if isinstance(accelerometer, AccelerometerCalibration):
        fit, correction = accelerometer.fit, accelerometer.correction
        free = fit.shape_stderr > 0
        if free[1, 0]:  # scales alone where the poses are few: misalignment is not in that model
            name = "accelerometer scale and misalignment"
            _add(scores, name, (fit.shape - s.accel_shape)[free], fit.shape_stderr[free])
            _add(scores, "accelerometer bias", fit.offset - s.accel_bias, fit.offset_stderr)
    else:
        refusals[f"accelerometer: {_kind(accelerometer)}"] += 1
    runs = [run for run in analysis.clean if run.role is Role.FIT]
    scale = calibrate_scale(find_turns(runs, found.g_sensitivity.value * float(found.significant), correction))
    if isinstance(scale, ScaleCalibration):
        _add(scores, "gyro scale and misalignment", scale.matrix - s.gyro_matrix, scale.stderr)
    else:
        refusals[f"gyro scale: {_kind(scale)}"] += 1
    if s.run.mag is None:
        return
    mag = calibrate_magnetometer(s.run.mag.field)
    if isinstance(mag, MagnetometerCalibration):
        _add(scores, "hard iron", mag.fit.offset - s.hard_iron, mag.fit.offset_stderr)
        upper = np.triu_indices(3)
        _add(scores, "soft iron", (mag.fit.shape - s.soft_iron)[upper], mag.fit.shape_stderr[upper])
    else:
        refusals[f"magnetometer: {_kind(mag)}"] += 1


def _kind(words: str) -> str:
    """A refusal without its numbers."""
    return re.sub(r"[0-9.]+", "n", words)


def _sweep(seed: int, scores: Scores) -> None:
    """The column of G along the motion, the one that a sweep in one mounting shows; of every other sensor k."""
    k = float(np.random.default_rng([seed, 78]).normal() * SessionParameters.g_typical)
    g = ((0.0, k, 0.0), (0.0, 0.0, k), (k, 0.0, 0.0)) if seed % 2 == 0 else None
    chain = ChainParameters(rate_hz=100.0, **({"accel_scale": 0.0, "accel_misalignment": 0.0} if g else {}))
    parameters = SessionParameters(seed=seed, plan=sweep_plan(seed), chain=chain, g_matrix=g)
    session = simulate(parameters)
    found, analysis = calibrate_gyro([(run, Role(role)) for run, role in session.runs], "mpu6050")
    mounting = next(
        r.mounting for r in analysis.campaign.runs if r.mounting is not None and r.mounting.along is not None
    )
    along = np.asarray(mounting.along) / np.linalg.norm(np.asarray(mounting.along))
    first = analysis.likelihood.columns.start["g_sensitivity"]
    covariance = analysis.claims.full.covariance[first : first + 9, first : first + 9]
    rows = np.kron(np.eye(3), along)
    stderr = np.sqrt(np.einsum("ij,jk,ik->i", rows, covariance, rows))
    true = session.g_matrix @ session.sensor_from_carriage[:, 0]
    _add(scores, "G along the motion, sweeps", found.g_sensitivity.value @ along - true, stderr)
    if g is not None:
        _add(scores, "k, sweeps", found.k.value - k, found.k.stderr)


def _null(seed: int) -> bool:
    s = simulate_poses(PoseParameters(seed=seed, g_typical=0.0))
    return calibrate_gyro(_split(s.run), "mpu6050")[0].significant


def _split(run: Run) -> list[tuple[Run, Role]]:
    """The end of the run is held out: judging each pose in turn would only cost time here."""
    cut = round(len(run.imu) * (1 - HELD_OUT_PART))
    imu = run.imu

    def part(piece: slice) -> ImuSeries:
        return replace(
            imu,
            stamp_ns=imu.stamp_ns[piece],
            received_ns=imu.received_ns[piece],
            angular_rate=imu.angular_rate[piece],
            specific_force=imu.specific_force[piece],
        )

    fit = replace(run, imu=part(slice(0, cut)))
    held = replace(run, path=Path(f"{run.path}_held"), name=f"{run.name} held", imu=part(slice(cut, None)))
    return [(fit, Role.FIT), (held, Role.HELD_OUT)]


def _add(scores: Scores, name: str, error: np.ndarray, stderr: np.ndarray) -> None:
    scores.setdefault(name, []).extend(float(v) for v in np.ravel(np.asarray(error) / np.asarray(stderr)))


def _arguments() -> argparse.Namespace:
    parser = arguments("./rig exec python tests/study/calibration.py", __doc__)
    parser.add_argument("--poses", type=int, default=100, help="sessions of still poses")
    parser.add_argument("--sweeps", type=int, default=30, help="sessions on the rail")
    parser.add_argument("--nulls", type=int, default=100, help="sessions of still poses without g-sensitivity")
    parser.add_argument("--first-seed", type=int, default=0, help="another one gives fresh sessions")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())
