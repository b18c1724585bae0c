"""The thesis's figures 7.1 to 7.7 (7.3 is a block diagram) on simulated sessions: what its author saw, and why.

./rig bench thesis_figures [--out out/thesis] [--seed 1]

Simulates the plan `thesis` (2, 4, 5, 7 rad/s; g-sensitivity 0.1 deg/s/g) and draws, of each figure, the angles as the
thesis made them (25 Hz, Madgwick's gain 0.1 for samples of a fixed rate, no bias taken off) and as gsense makes them.
Below each, what is left of what is seen with one suspected cause switched off.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from scipy.spatial.transform import Rotation  # noqa: E402
from tests.developer import arguments  # noqa: E402

from gsense_fusion.attitude import Madgwick, MadgwickParameters, attitude_at_rest  # noqa: E402
from gsense_fusion.attitude.carriage import CarriageAid  # noqa: E402
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
K = float(np.radians(0.1) / 9.80665)
THESIS_HZ = 25.0


def simulate(out: Path, seed: int) -> None:
    path = os.pathsep.join([str(ROOT / "src" / "gsense_rig"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "gsense_rig.simulate", "thesis", "--out", str(out), "--seed", str(seed)]
    effect = f"g_sensitivity={K}"
    subprocess.run([*command, "--effect", effect], check=True, env=os.environ | {"PYTHONPATH": path})


def fitted_k(run: Run) -> float:
    """The thesis's k: the slope of one straight line through all axes of gyro against the cyclic accelerations."""
    rate, force = run.imu.angular_rate, run.imu.specific_force
    x = force[:, [1, 2, 0]] - force[:, [1, 2, 0]].mean(axis=0)
    y = rate - rate.mean(axis=0)
    return float(np.sum(x * y) / np.sum(x * x))


@dataclass(frozen=True)
class Way:
    """How the thesis's author worked, and what of it is switched off."""

    bias_off: bool = False
    """The gyro's zero taken from the first second at rest."""
    acceleration_off: bool = False
    """The carriage's acceleration (encoder) taken out of the specific force."""
    sensitivity_off: bool = False
    """The simulated g-sensitivity, exactly, taken off the rate."""
    every_sample: bool = False
    """All samples at their own stamps."""
    beta: float = BETA


WAYS = {
    "as in the thesis": Way(),
    "gyro's zero taken off": Way(bias_off=True),
    "no linear acceleration": Way(acceleration_off=True),
    "neither": Way(bias_off=True, acceleration_off=True),
    "no g-sensitivity": Way(sensitivity_off=True),
    "every sample, stamps": Way(every_sample=True),
    "zero off, half the gain": Way(bias_off=True, beta=BETA / 2),
    "zero off, no g-sensitivity": Way(bias_off=True, sensitivity_off=True),
}


def as_in_the_thesis(run: Run, k: float | None, use_mag: bool, way: Way) -> tuple[Any, Any]:
    """Time and attitude: 25 Hz taken for a fixed rate, bias left in, but for what `way` switches off."""
    step = 1 if way.every_sample else max(round(run.imu.rate_hz / THESIS_HZ), 1)
    rate, force = run.imu.angular_rate, run.imu.specific_force
    off = K if way.sensitivity_off else k
    if off is not None:
        rate = rate - off * force[:, [1, 2, 0]]
    if way.bias_off:
        rate = rate - rate[: round(run.imu.rate_hz)].mean(axis=0)
    start = force[: round(run.imu.rate_hz)].mean(axis=0)
    if way.acceleration_off:
        assert run.pose is not None
        aid = CarriageAid()
        for stamp, position in zip(run.pose.stamp_ns, run.pose.position, strict=True):
            aid.add_position(int(stamp), float(position))
        force = aid.clean_block(run.imu.stamp_ns, np.ascontiguousarray(force))
    rate, force = (np.ascontiguousarray(a[::step]) for a in (rate, force))
    field = None
    if use_mag and run.mag is not None:
        at = np.clip(np.searchsorted(run.mag.stamp_ns, run.imu.stamp_ns[::step], side="right") - 1, 0, None)
        field = run.mag.field[at]
    madgwick = Madgwick(MadgwickParameters(way.beta, way.beta))
    madgwick.quaternion = attitude_at_rest(start, None if field is None else field[:25].mean(axis=0))
    stamps = run.imu.seconds[::step]
    dt = np.diff(stamps, prepend=stamps[0]) if way.every_sample else np.full(len(rate), 1 / THESIS_HZ)
    return stamps, madgwick.batch(dt, rate, force, field)


def moving_part(x: Any) -> Any:
    return (x > 0.3 * x[-1]) & (x < 0.8 * x[-1])


def ablation(run: Run, k: float | None, use_mag: bool, omega: float) -> str:
    """What is left of each phenomenon with a suspected cause switched off."""
    lines = [f"    {'with':28}{'tilt off, deg':>14}{'its swing at the drive, deg':>29}{'yaw, deg/min':>14}"]
    for name, way in WAYS.items():
        x, quaternion = as_in_the_thesis(run, k, use_mag, way)
        values, moving = euler(quaternion), moving_part(x)
        t, tilt = x[moving], values[moving][:, :2] - values[: len(x) // 40, :2].mean(axis=0)
        basis = np.stack([np.ones(len(t)), t - t.mean(), np.cos(omega * t), np.sin(omega * t)], axis=1)
        fit = np.linalg.lstsq(basis, tilt, rcond=None)[0]
        yaw = np.polyfit(t, values[moving][:, 2], 1)[0] * 60
        lines.append(f"    {name:28}{np.linalg.norm(fit[0]):14.2f}{np.linalg.norm(fit[2:]):29.3f}{yaw:14.1f}")
    return "\n".join(lines)


def straightness(run: Run, omega: float) -> str:
    """Is gyro against acceleration (axes of equation 7.4) a straight line? At the drive's frequency, strongest axis."""
    t, force = run.imu.seconds, run.imu.specific_force[:, [1, 2, 0]]
    moving = moving_part(t)
    axis = int(np.argmax(force[moving].std(axis=0)))
    x, y = force[moving, axis] - force[moving, axis].mean(), run.imu.angular_rate[moving, axis]
    carrier = np.exp(-1j * omega * t[moving])
    phase = np.angle(np.sum((y - y.mean()) * carrier) / np.sum(x * carrier))
    noise = np.degrees(np.std(y - np.polyval(np.polyfit(x, y, 1), x)))
    r = np.corrcoef(x, y)[0, 1]
    share = np.degrees(np.polyfit(x, y, 1)[0] * x.std())
    lag = np.degrees(phase)
    return (
        f"    gyro against acceleration: r {r:.2f}, line {share:.3f} deg/s rms in noise of {noise:.3f}, phase at the "
        f"drive {lag:.1f} deg ({lag / np.degrees(omega) * 1e3:.0f} ms)"
    )


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
    t, theirs = as_in_the_thesis(run, k, sensor == "bno055", Way())
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
        moving = moving_part(x)
        tilt = np.hypot(*(values[moving][:, i] - values[: len(x) // 40, i].mean() for i in (0, 1)))
        drift = np.polyfit(x[moving], values[moving][:, 2], 1)[0] * 60
        found.append(f"    {label:50} tilt {np.sqrt(np.mean(tilt**2)):7.3f} deg rms, yaw {drift:8.2f} deg/min")
    found += [ablation(run, k, sensor == "bno055", omega), straightness(run, omega)]
    return f"figure {figure} ({sensor}, {omega:g} rad/s{', compensated' if compensated else ''})\n" + "\n".join(found)


def main() -> int:
    parser = arguments("./rig bench thesis_figures", __doc__)
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "thesis", help="folder of the figures")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn")
    options = parser.parse_args()
    sessions = options.out / "sessions"
    simulate(sessions, options.seed)
    for figure, sensor, omega, name, compensated in FIGURES:
        print(draw(options.out, figure, sensor, omega, load_run(sessions / name, sensor), compensated), flush=True)
    print(f"figures in {options.out}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
