"""Accuracy of the attitude filters: four measured BROAD trials, and the simulated rail at 7 rad/s.

./rig bench fusion_accuracy [--seeds 3] [--only broad|rail]

BROAD (measured; found through GSENSE_DATA or ../shared/data): root mean squares of inclination, heading and total error
in degrees, by the definitions of `replay` (a constant rotation over the first 5 s at rest taken out) and, "as it is",
with only the mean heading at rest taken out. Beside gsense's filters the libraries vqf, imufusion and ahrs with their
defaults, from the first sample on.

Rail (simulated): g-sensitivity 0.1 deg/s/g in the pattern of the thesis's equation 7.4, the same unit at rest and at
7 rad/s in five mountings; tilt root mean squares from the first motion on, and the gyro's own tilt and heading at the
drive's frequency. "f zeroed": with the accelerometer's bias at rest taken off.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion"), str(ROOT / "src" / "gsense_rig")]

from scipy.spatial.transform import Rotation  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.study.bounded import leave_one_out, trial_of, words  # noqa: E402

from gsense_fusion.attitude.accuracy import score  # noqa: E402
from gsense_fusion.attitude.errors import heading_error, inclination_error, total_error  # noqa: E402
from gsense_fusion.attitude.recorded import reference_of_run  # noqa: E402
from gsense_fusion.bags import Run, load_run  # noqa: E402
from gsense_fusion.compensation import AccelerometerCorrection, CompensationFile, GSensitivity  # noqa: E402
from gsense_fusion.replay import replay  # noqa: E402

TRIALS = (
    "07_undisturbed_fast_rotation_B",
    "10_undisturbed_slow_translation_A",
    "15_undisturbed_fast_translation_A",
    "24_disturbed_tapping_A",
)
K = float(np.radians(0.1) / 9.80665)
G = GSensitivity(k=K)
OMEGA = 7.0
MOUNTINGS = {
    "90": "the rail along the sensor's y",
    "0": "along x: the acceleration turns the heading (equation 7.4), not the tilt",
    "180": "the board turned by 180 degrees",
    "tilt_x": "on its side, z along the horizontal across the rail",
    "tilt_y": "on end, the rail along z",
}


def broad_folder() -> Path | None:
    folder = Path(os.environ.get("GSENSE_DATA", ROOT.parent / "shared" / "data")) / "broad"
    return folder if folder.is_dir() else None


def peers(run: Run) -> dict[str, Any]:
    """Attitudes of the libraries, body -> ENU, shape (n, 4)."""
    import ahrs
    import imufusion
    from vqf import VQF

    rate, force = (np.ascontiguousarray(a) for a in (run.imu.angular_rate, run.imu.specific_force))
    assert run.mag is not None
    assert np.array_equal(run.mag.stamp_ns, run.imu.stamp_ns)
    field, dt = np.ascontiguousarray(run.mag.field), 1 / run.imu.rate_hz
    fusion = imufusion.Ahrs()
    settings = imufusion.AhrsSettings()
    settings.convention = imufusion.CONVENTION_ENU
    fusion.set_settings(settings)
    fusion.set_sample_period(dt)  # after the settings, which set a rate of their own
    found = np.empty((len(rate), 4))
    degrees, gravities, microtesla = np.degrees(rate), force / 9.80665, field * 1e6
    for i in range(len(rate)):
        fusion.update(degrees[i], gravities[i], microtesla[i])
        found[i] = fusion.get_quaternion()
    # ahrs' Madgwick takes gravity for +z and north for +x: its earth frame is north-west-up
    nwu = Rotation.from_matrix([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    madgwick = ahrs.filters.Madgwick(gyr=rate, acc=force, mag=field * 1e9, frequency=1 / dt).Q
    turned = (nwu * Rotation.from_quat(madgwick[:, [1, 2, 3, 0]])).as_quat()[:, [3, 0, 1, 2]]
    return {
        "vqf (library)": VQF(dt).updateBatch(rate, force, field)["quat9D"],
        "imufusion": found,
        "ahrs Madgwick": turned,
    }


def rms(values: Any) -> float:
    return float(np.degrees(np.sqrt(np.mean(np.square(values)))))


def as_it_is(estimate: Any, reference: Any) -> tuple[float, float, float]:
    """Errors with only the mean heading at rest taken out of the heading."""
    rows, true = reference.scored, reference.orientation
    heading = heading_error(estimate, np.nan_to_num(true, nan=0.5))
    mean = np.angle(np.mean(np.exp(1j * heading[reference.rest])))
    left = (heading[rows] - mean + np.pi) % (2 * np.pi) - np.pi
    return rms(inclination_error(estimate[rows], true[rows])), rms(left), rms(total_error(estimate[rows], true[rows]))


def broad() -> None:
    """Every filter and library on the four trials."""
    folder = broad_folder()
    if folder is None:
        print("BROAD is not here (set GSENSE_DATA to the folder of recordings): not done")
        return
    found: dict[str, list[tuple[float, ...]]] = {}
    runs = [load_run(folder / trial, "broad") for trial in TRIALS]
    for trial, run in zip(TRIALS, runs, strict=True):
        result = replay(run)
        everything = {**result.estimates.quaternion, **peers(run)}
        reference = reference_of_run(run, None, result.stamp_ns)
        print(f"{trial} (measured), deg rms")
        print(f"  {'':16}{'aligned over 5 s at rest':>30}{'as it is':>30}")
        print(f"  {'filter':16}" + f"{'inclination':>12}{'heading':>9}{'total':>9}" * 2)
        for name, estimate in everything.items():
            a = score(estimate, reference, has_heading=True)
            values = np.degrees([a.inclination, a.heading, a.total]).tolist()
            plain = as_it_is(estimate, reference)
            found.setdefault(name, []).append((*values, *plain))
            print(f"  {name:16}" + "".join(f"{x:12.3f}{y:9.3f}{z:9.3f}" for x, y, z in (values, plain)))
        apart = total_error(everything["vqf"], everything["vqf (library)"])
        print(f"  vqf here and vqf's library: at most {np.degrees(apart[2000:].max()):.4f} deg apart after 7 s")
    print(
        "means of the four: inclination, heading, total (aligned), the same as it is; inclination beside vqf's library"
    )
    base = np.mean(found["vqf (library)"], axis=0)
    for name, values in found.items():
        mean = np.mean(values, axis=0)
        text = "".join(f"{x:8.3f}" for x in mean)
        print(f"  {name:16}{text}   {mean[0] / base[0]:6.3f}{mean[3] / base[3]:7.3f}")
    bounded_left_out(runs, float(base[0]))


def bounded_left_out(runs: Sequence[Run], library: float) -> None:
    """`bounded` with its defaults, which no recording chose, and with what the other three trials would choose."""
    trials = []
    for run in runs:
        stamps = run.imu.stamp_ns
        rate, force = (np.ascontiguousarray(a) for a in (run.imu.angular_rate, run.imu.specific_force))
        dt = np.diff(stamps, prepend=stamps[0]) * 1e-9
        trials.append(trial_of(run.name, dt, rate, force, reference_of_run(run, None, stamps)))
    print("bounded, inclination (aligned) of each trial, mean, and that beside vqf's library")
    chosen = leave_one_out(trials)
    rows = {
        "defaults, from simulation (tests/study/bounded.py)": [trial.inclination({}) for trial in trials],
        "as the three other trials would choose": [chosen[trial.name][0] for trial in trials],
    }
    for name, values in rows.items():
        mean = float(np.mean(values))
        print(f"  {name:52}" + "".join(f"{x:7.3f}" for x in [*values, mean]) + f"{mean / library:8.3f}")
    for trial in trials:
        print(f"    without {trial.name}: {words(chosen[trial.name][1])}")


def simulate(folder: Path, seed: int, mountings: Sequence[str], seconds: float = 60.0) -> list[Path]:
    """A session of one unit, a run for each mounting."""
    sine = {"shape": "sine", "amplitude": 0.15, "angular_frequency": OMEGA, "duration": seconds, "role": "fit"}
    plan = folder / "plan.yaml"
    plan.write_text(yaml.safe_dump({"runs": [{**sine, "mounting": mounting} for mounting in mountings]}))
    out = folder / f"seed{seed}"
    path = os.pathsep.join([str(ROOT / "src" / "gsense_rig"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-m", "gsense_rig.simulate", str(plan), "--out", str(out), "--seed", str(seed)]
    subprocess.run(
        [*command, "--effect", f"g_sensitivity={K}"],
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env=os.environ | {"PYTHONPATH": path},
    )
    return [out / f"run_{i:02d}" for i in range(len(mountings))]


def at_drive(run: Run, stamp_ns: Any, quaternion: Any) -> tuple[float, float]:
    """Amplitudes of tilt and heading at the drive's frequency, deg: least squares with a drift, on the moving part."""
    assert run.pose is not None
    t = (stamp_ns - stamp_ns[0]) * 1e-9
    speed = np.gradient(run.pose.position, run.pose.stamp_ns * 1e-9)
    moving = np.abs(np.interp(stamp_ns, run.pose.stamp_ns, speed)) > 0.05
    span = slice(int(np.argmax(moving)), len(moving) - int(np.argmax(moving[::-1])))
    t = t[span]
    turn = Rotation.from_quat(quaternion[span][:, [1, 2, 3, 0]])
    error = (turn * turn[0].inv()).as_rotvec()  # earth frame; small
    u = (t - t.mean()) / np.ptp(t)
    basis = np.stack([np.cos(OMEGA * t), np.sin(OMEGA * t), *(u**k for k in range(6))], axis=1)
    fit = np.degrees(np.linalg.lstsq(basis, error - error.mean(axis=0), rcond=None)[0][:2])
    return float(np.linalg.norm(fit[:, :2])), float(np.linalg.norm(fit[:, 2]))


def zeroed(run: Run) -> CompensationFile:
    """The file with the accelerometer zeroed at rest: the complementary filter's gate is about a length of g."""
    rest = run.imu.specific_force[: round(run.imu.rate_hz)].mean(axis=0)
    true = np.zeros(3)
    axis = int(np.argmax(np.abs(rest)))
    true[axis] = np.copysign(9.80665, rest[axis])
    x, y, z = (float(v) for v in rest - true)
    identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    return CompensationFile("mpu6050", terms=(G,), accelerometer=AccelerometerCorrection(identity, (x, y, z)))


@dataclass
class RailTable:
    """What the runs of one mounting gave, deg."""

    tilt: dict[str, dict[str, list[float]]] = field(default_factory=dict)
    """Filter -> raw or gcomp -> rms of each seed."""
    drive: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Of the gyro alone at the drive's frequency: tilt raw, compensated; heading raw, compensated."""

    def add(self, run: Run) -> None:
        result = replay(run, None, CompensationFile("mpu6050", terms=(G,)))
        # its gate lets through what is g long: with a bias, that is not the acceleration of zero
        gated = replay(run, ["complementary"], zeroed(run)).accuracy["complementary"]
        for name, both in {**result.accuracy, "complementary, f zeroed": gated}.items():
            for key, a in both.items():
                self.tilt.setdefault(name, {}).setdefault(key, []).append(float(np.degrees(a.inclination)))
        raw, compensated = (
            at_drive(run, result.stamp_ns, result.estimates.quaternion[name])
            for name in ("gyro_only", "gyro_only_gcomp")
        )
        self.drive.append((raw[0], compensated[0], raw[1], compensated[1]))

    def show(self, mounting: str, words: str) -> None:
        print(f"mounting {mounting}, {words}: tilt, deg rms: worst (each seed)")
        for name, both in self.tilt.items():
            texts = [f"{max(v):8.4f} ({', '.join(f'{x:.3f}' for x in v)})" for v in both.values()]
            print(f"  {name:24} as measured {texts[0]}   compensated {texts[-1]}")
        for what, i in (("tilt", 0), ("heading", 2)):
            pairs = [row[i : i + 2] for row in self.drive]
            text = ", ".join(f"{a:.5f} to {b:.5f} ({100 * (b / a - 1):+.1f} %)" for a, b in pairs)
            print(f"  {what} of the gyro alone at the drive's frequency, deg: {text}")


def rail(seeds: int) -> None:
    tables = {name: RailTable() for name in MOUNTINGS}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1, seeds + 1):
            for name, bag in zip(MOUNTINGS, simulate(Path(folder), seed, tuple(MOUNTINGS)), strict=True):
                tables[name].add(load_run(bag, "mpu6050"))
    print(f"rail (simulated), {OMEGA:g} rad/s, 0.15 m, g-sensitivity 0.1 deg/s/g, 60 s, units 1 to {seeds}")
    for name, table in tables.items():
        table.show(name, MOUNTINGS[name])


def main() -> int:
    parser = arguments("./rig bench fusion_accuracy", __doc__)
    parser.add_argument("--seeds", type=int, default=3, help="units on the rail")
    parser.add_argument("--only", choices=("broad", "rail"), help="one of the two parts")
    options = parser.parse_args()
    if options.only != "rail":
        broad()
    if options.only != "broad":
        rail(options.seeds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
