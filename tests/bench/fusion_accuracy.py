"""Accuracy of the attitude filters: four measured BROAD trials, and the simulated rail at 7 rad/s.

./rig bench fusion_accuracy [--seeds 3]

BROAD (measured; found through GSENSE_DATA or ../shared/data): root mean squares of inclination, heading and total error
in degrees, by the definitions of `replay` (a constant rotation over the first 5 s at rest taken out) and, "as it is",
with only the mean heading at rest taken out. Beside gsense's filters the libraries vqf, imufusion and ahrs with their
defaults, from the first sample on.

Rail (simulated): g-sensitivity 0.1 deg/s/g in the pattern of the thesis's equation 7.4, the same unit at rest and at
7 rad/s; tilt root mean squares from the first motion on, and the gyro's own tilt at the drive's frequency.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import yaml

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion"), str(ROOT / "src" / "gsense_rig")]

from scipy.spatial.transform import Rotation  # noqa: E402

from gsense_fusion.attitude import FILTERS  # noqa: E402
from gsense_fusion.attitude.accuracy import score  # noqa: E402
from gsense_fusion.attitude.errors import heading_error, inclination_error, total_error  # noqa: E402
from gsense_fusion.attitude.recorded import reference_of_run  # noqa: E402
from gsense_fusion.bags import Run, load_run  # noqa: E402
from gsense_fusion.compensation import CompensationFile, GSensitivity  # noqa: E402
from gsense_fusion.replay import replay  # noqa: E402

TRIALS = (
    "07_undisturbed_fast_rotation_B",
    "10_undisturbed_slow_translation_A",
    "15_undisturbed_fast_translation_A",
    "24_disturbed_tapping_A",
)
K = np.radians(0.1) / 9.80665
OMEGA = 7.0


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
    folder = broad_folder()
    if folder is None:
        print("BROAD is not here (set GSENSE_DATA to the folder of recordings): not done")
        return
    inclinations: dict[str, list[tuple[float, float]]] = {}
    for trial in TRIALS:
        run = load_run(folder / trial, "broad")
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
            inclinations.setdefault(name, []).append((values[0], plain[0]))
            print(f"  {name:16}" + "".join(f"{x:12.3f}{y:9.3f}{z:9.3f}" for x, y, z in (values, plain)))
        apart = total_error(everything["vqf"], everything["vqf (library)"])
        print(f"  vqf here and vqf's library: at most {np.degrees(apart[2000:].max()):.4f} deg apart after 7 s")
    print("mean inclination of the four (aligned, as it is), and beside the vqf library's")
    base = np.mean(inclinations["vqf (library)"], axis=0)
    for name, values in inclinations.items():
        mean = np.mean(values, axis=0)
        print(f"  {name:16}{mean[0]:8.3f}{mean[1]:8.3f}   {mean[0] / base[0]:6.3f}{mean[1] / base[1]:7.3f}")


def simulate(folder: Path, seed: int, seconds: float = 60.0) -> Run:
    plan = folder / "plan.yaml"
    runs = [
        {
            "shape": "sine",
            "amplitude": 0.15,
            "angular_frequency": OMEGA,
            "duration": seconds,
            "mounting": "90",
            "role": "fit",
        }
    ]
    plan.write_text(yaml.safe_dump({"runs": runs}))
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
    return load_run(out / "run_00", "mpu6050")


def at_drive(run: Run, stamp_ns: Any, quaternion: Any) -> float:
    """Amplitude of the tilt at the drive's frequency, deg: least squares with a drift, on the moving part."""
    assert run.pose is not None
    t = (stamp_ns - stamp_ns[0]) * 1e-9
    moving = (
        np.abs(np.interp(stamp_ns, run.pose.stamp_ns, np.gradient(run.pose.position, run.pose.stamp_ns * 1e-9))) > 0.05
    )
    span = slice(int(np.argmax(moving)), len(moving) - int(np.argmax(moving[::-1])))
    t = t[span]
    up = Rotation.from_quat(quaternion[span][:, [1, 2, 3, 0]]).inv().apply([0.0, 0.0, 1.0])
    u = (t - t.mean()) / np.ptp(t)
    basis = np.stack([np.cos(OMEGA * t), np.sin(OMEGA * t), *(u**k for k in range(6))], axis=1)
    fit = np.linalg.lstsq(basis, up - up.mean(axis=0), rcond=None)[0]
    return float(np.degrees(np.linalg.norm(fit[:2])))


def rail(seeds: int) -> None:
    file = CompensationFile("mpu6050", terms=(GSensitivity(k=K),))
    found: dict[str, list[float]] = {}
    drive: dict[str, list[float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(1, seeds + 1):
            run = simulate(Path(folder), seed)
            result = replay(run, list(FILTERS), file)
            for name, both in result.accuracy.items():
                for key, a in both.items():
                    found.setdefault(f"{name} {key}", []).append(float(np.degrees(a.inclination)))
            for channel in ("gyro_only", "gyro_only_gcomp"):
                drive.setdefault(channel, []).append(
                    at_drive(run, result.stamp_ns, result.estimates.quaternion[channel])
                )
    print(f"rail (simulated), {OMEGA:g} rad/s, 0.15 m, g-sensitivity 0.1 deg/s/g, 60 s, the rail along the sensor's y;")
    print(f"tilt in deg rms, seeds 1 to {seeds}")
    for name, values in found.items():
        print(f"  {name:22}" + "".join(f"{value:9.4f}" for value in values))
    raw, compensated = drive["gyro_only"], drive["gyro_only_gcomp"]
    print(
        "tilt of the gyro alone at the drive's frequency, deg: "
        + ", ".join(f"{a:.5f} to {b:.5f}" for a, b in zip(raw, compensated, strict=True))
    )
    print("falls by " + ", ".join(f"{100 * (1 - b / a):.1f} %" for a, b in zip(raw, compensated, strict=True)))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    broad()
    rail(options.seeds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
