"""Hard and soft iron on measured recordings, each judged where it was not fitted.

./rig bench magnetometer

The four BROAD trials (measured; found through GSENSE_DATA or ../shared/data): of each alone what the calibration says;
then the calibration from its first half, and from the other three together, and what they do to this one: spread of
the field's strength, and the heading's error of `vqf` and `bounded` against the optical reference. An independent
answer stands beside: with the optical attitude, the field is a constant of the room plus one of the sensor, by least
squares.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from scipy.spatial.transform import Rotation  # noqa: E402
from tests.developer import arguments  # noqa: E402

from gsense_fusion.attitude.accuracy import at_samples  # noqa: E402
from gsense_fusion.bags import Run, load_run  # noqa: E402
from gsense_fusion.calibration.magnetometer import MagnetometerCalibration, calibrate_magnetometer  # noqa: E402
from gsense_fusion.compensation import CompensationFile  # noqa: E402
from gsense_fusion.replay import replay  # noqa: E402

TRIALS = (
    "07_undisturbed_fast_rotation_B",
    "10_undisturbed_slow_translation_A",
    "15_undisturbed_fast_translation_A",
    "24_disturbed_tapping_A",
)
FILTERS = ("vqf", "bounded")


def optical(run: Run) -> tuple[str, float]:
    """Hard iron by least squares with the optical attitude, in words, and what it leaves (relative)."""
    assert run.mag is not None
    assert run.reference is not None
    attitude = at_samples(run.mag.stamp_ns, run.reference.stamp_ns, run.reference.orientation)
    rows = np.flatnonzero(np.isfinite(attitude).all(axis=1))[::20]
    to_body = Rotation.from_quat(attitude[rows][:, [1, 2, 3, 0]]).inv().as_matrix()
    design = np.concatenate([to_body, np.tile(np.eye(3), (len(rows), 1, 1))], axis=2).reshape(-1, 6)
    field = run.mag.field[rows].ravel()
    fit, *_ = np.linalg.lstsq(design, field, rcond=None)
    left = float(np.sqrt(np.mean((field - design @ fit) ** 2)) / np.linalg.norm(fit[:3]))
    return vector(fit[3:]), left


def vector(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{1e6 * v:+.2f}" for v in values) + "] uT"


def tell(found: MagnetometerCalibration | str) -> str:
    if isinstance(found, str):
        return f"refused: {found}"
    soft = np.abs(found.fit.shape - np.eye(3)).max()
    return (
        f"hard iron {vector(found.fit.offset)} +- {1e6 * found.fit.offset_stderr.max():.2f}, soft iron up to "
        f"{100 * soft:.1f} %, field {1e6 * found.field:.1f} uT, {found.directions} directions"
    )


def judge(run: Run, found: MagnetometerCalibration, first: int = 0) -> None:
    """On what was not fitted: fields from number `first` on; headings of the whole run."""
    assert run.mag is not None
    field = run.mag.field[first:]
    before, after = (np.linalg.norm(v, axis=1) for v in (field, found.fit.apply(field)))
    spread = [100 * float(np.std(v) / np.mean(v)) for v in (before, after)]
    print(f"    spread of the strength here {spread[0]:.2f} -> {spread[1]:.2f} %")
    accuracy = replay(run, FILTERS, CompensationFile("broad", magnetometer=found.correction)).accuracy
    for name, both in accuracy.items():
        raw, corrected = (float(np.degrees(both[key].heading)) for key in ("raw", "gcomp"))
        print(f"    heading of {name}, deg rms: {raw:.2f} -> {corrected:.2f}")


def main() -> int:
    arguments("./rig bench magnetometer", __doc__).parse_args()
    folder = Path(os.environ.get("GSENSE_DATA", ROOT.parent / "shared" / "data")) / "broad"
    if not folder.is_dir():
        print("BROAD is not here (set GSENSE_DATA to the folder of recordings): not done")
        return 0
    runs = [load_run(folder / trial, "broad") for trial in TRIALS]
    fields = [run.mag.field for run in runs if run.mag is not None]
    for i, run in enumerate(runs):
        hard, left = optical(run)
        print(
            f"{run.name} (measured)\n  by the optical attitude: hard iron {hard}, left {100 * left:.1f} % of the field"
        )
        print(f"  alone: {tell(calibrate_magnetometer(fields[i]))}")
        half = calibrate_magnetometer(fields[i][: len(fields[i]) // 2])
        print(f"  from its first half: {tell(half)}")
        if isinstance(half, MagnetometerCalibration):
            judge(run, half, len(fields[i]) // 2)
        others = calibrate_magnetometer(np.concatenate([f for j, f in enumerate(fields) if j != i]))
        print(f"  from the three others: {tell(others)}", flush=True)
        if isinstance(others, MagnetometerCalibration):
            judge(run, others)
    return 0


if __name__ == "__main__":
    sys.exit(main())
