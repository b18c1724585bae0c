"""The thesis's figures 7.1 to 7.7 (7.3 is a block diagram) on simulated sessions: what its author saw, and why.

./rig bench thesis_figures [--out out/thesis] [--seed 1]

Simulates the plan `thesis` (2, 4, 5, 7 rad/s; g-sensitivity 0.1 deg/s/g) and draws, of each figure, the angles as the
thesis made them (25 Hz, Madgwick's gain 0.1 for samples of a fixed rate, no bias taken off) and as gsense makes them.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from scipy.spatial.transform import Rotation  # noqa: E402

from gsense_fusion.attitude import Madgwick, MadgwickParameters, attitude_at_rest  # noqa: E402
from gsense_fusion.bags import Run, load_run  # noqa: E402
from gsense_fusion.compensation import CompensationFile, GSensitivity  # noqa: E402
from gsense_fusion.replay import replay  # noqa: E402

# figure, sensor, rad/s, run of the plan, compensated
FIGURES = (
    ("7.1", "mpu6050", 2.0, "run_01", False),
    ("7.2", "mpu6050", 7.0, "run_04", False),
    ("7.4", "bno055", 2.0, "run_01", False),
    ("7.5", "bno055", 5.0, "run_03", False),
    ("7.6", "bno055", 7.0, "run_04", False),
    ("7.7", "bno055", 4.0, "run_02", True),
)
BETA = 0.1
THESIS_HZ = 25.0


def simulate(out: Path, seed: int) -> None:
    path = os.pathsep.join([str(ROOT / "src" / "gsense_rig"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "gsense_rig.simulate", "thesis", "--out", str(out), "--seed", str(seed)]
    effect = f"g_sensitivity={np.radians(0.1) / 9.80665}"
    subprocess.run([*command, "--effect", effect], check=True, env=os.environ | {"PYTHONPATH": path})


def fitted_k(run: Run) -> float:
    """The thesis's k: the slope of one straight line through all axes of gyro against the cyclic accelerations."""
    rate, force = run.imu.angular_rate, run.imu.specific_force
    x = force[:, [1, 2, 0]] - force[:, [1, 2, 0]].mean(axis=0)
    y = rate - rate.mean(axis=0)
    return float(np.sum(x * y) / np.sum(x * x))


def as_in_the_thesis(run: Run, k: float | None, use_mag: bool) -> tuple[Any, Any]:
    """Time and attitude: 25 Hz taken for a fixed rate, bias left in."""
    step = max(round(run.imu.rate_hz / THESIS_HZ), 1)
    rate, force = run.imu.angular_rate[::step], run.imu.specific_force[::step]
    if k is not None:
        rate = rate - k * force[:, [1, 2, 0]]
    field = None
    if use_mag and run.mag is not None:
        at = np.clip(np.searchsorted(run.mag.stamp_ns, run.imu.stamp_ns[::step], side="right") - 1, 0, None)
        field = run.mag.field[at]
    madgwick = Madgwick(MadgwickParameters(BETA, BETA))
    madgwick.quaternion = attitude_at_rest(force[:25].mean(axis=0), None if field is None else field[:25].mean(axis=0))
    return run.imu.seconds[::step], madgwick.batch(np.full(len(rate), 1 / THESIS_HZ), rate, force, field)


def euler(quaternion: Any) -> Any:
    """Roll, pitch, yaw against the start, deg, shape (n, 3)."""
    turn = Rotation.from_quat(quaternion[:, [1, 2, 3, 0]])
    return np.degrees(np.unwrap((turn[0].inv() * turn).as_euler("ZYX"), axis=0)[:, ::-1])


def draw(out: Path, figure: str, sensor: str, omega: float, run: Run, compensated: bool) -> str:
    k = fitted_k(run) if compensated else None
    file = CompensationFile(sensor, terms=(GSensitivity(k=k),)) if k is not None else None
    result = replay(run, ["madgwick", "rig_aided"], file)
    end = "_gcomp" if file else ""
    seconds = (result.stamp_ns - run.imu.stamp_ns[0]) * 1e-9
    t, theirs = as_in_the_thesis(run, k, sensor == "bno055")
    traces = [("as in the thesis (Madgwick, 25 Hz, bias left in)", t, euler(theirs))]
    for name, label in (("madgwick", "Madgwick by gsense"), ("rig_aided", "rig-aided by gsense")):
        traces.append((label, seconds, euler(result.estimates.quaternion[name + end])))
    fig, axes = plt.subplots(3, 1, sharex=True, figsize=(8, 6), layout="constrained")
    for axis, ax in enumerate(axes):
        for label, x, values in traces:
            ax.plot(x, values[:, axis], lw=0.8, label=label)
        ax.set_ylabel(f"{('roll', 'pitch', 'yaw')[axis]}, deg")
    axes[0].legend(fontsize=7, loc="upper left")
    axes[2].set_xlabel("s")
    title = f"Figure {figure} on simulated data: {sensor}, {omega:g} rad/s"
    fig.suptitle(title + (f", k = {np.degrees(k) * 9.80665:.3f} deg/s/g" if k is not None else ""))
    fig.savefig(out / f"figure_{figure.replace('.', '_')}.png", dpi=120)
    plt.close(fig)
    found = []
    for label, x, values in traces:
        moving = (x > 0.3 * x[-1]) & (x < 0.8 * x[-1])
        tilt = np.hypot(*(values[moving][:, i] - values[: len(x) // 40, i].mean() for i in (0, 1)))
        drift = np.polyfit(x[moving], values[moving][:, 2], 1)[0] * 60
        found.append(f"    {label:50} tilt {np.sqrt(np.mean(tilt**2)):7.3f} deg rms, yaw {drift:8.2f} deg/min")
    return f"figure {figure} ({sensor}, {omega:g} rad/s{', compensated' if compensated else ''})\n" + "\n".join(found)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "thesis")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    sessions = options.out / "sessions"
    simulate(sessions, options.seed)
    for figure, sensor, omega, name, compensated in FIGURES:
        print(draw(options.out, figure, sensor, omega, load_run(sessions / name, sensor), compensated), flush=True)
    print(f"figures in {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
