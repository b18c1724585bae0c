"""The watcher on hours of simulated shifts: false alarms, and how soon and as what a new effect is reported.

./rig bench watch [--hours 1] [--faults 16] [--first-seed 1]
"""

from __future__ import annotations

import os

for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")

import sys  # noqa: E402
import time  # noqa: E402
from multiprocessing import Pool  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from rich.progress import track  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.fusion.watch.live import Shift, first_alarm, watch  # noqa: E402
from tests.study.simulator.parameters import Disturbance  # noqa: E402

SOON_S = 60.0
HOUR = (4.0, 7.0, 1.0, 8.0, 2.5, 5.0, 3.0, 6.0)
# Sizes of the simulator's own units; what a right answer may name (the simulator's forms are not the catalogue's).
FAULTS = {
    "rail_curvature": (1.5e-3, {"rail_curvature", "speed_pickup", "belt_tilt", "jerk_coupling"}),
    "rectification": (4e-5, {"g_squared"}),
    "bias_jump": (8e-4, {"bias_jump"}),
    "motion_tone": (4e-4, {"line_tone", "belt_tooth"}),
    "speed_noise": (3e-4, {"speed_noise"}),
}


def quiet_hour(seed: int) -> tuple[float, list[str]]:
    """Hours watched and alarms raised with nothing hidden."""
    shift = Shift(seed, frequencies=HOUR, duration_s=405.0, rest_s=45.0)
    last, alarms = 0.0, []
    for report in watch(shift):
        last = report.time
        alarms += [f"seed {seed}, {report.time:.0f} s: {alarm.text}" for alarm in report.fresh]
    return last / 3600.0, alarms


def fault(job: tuple[int, str]) -> tuple[str, float | None, str, str]:
    """One fault that enters at a random time: its kind, the delay, what was named, whether that is right."""
    seed, kind = job
    rng = np.random.default_rng([seed, 77])
    w = float(rng.uniform(4.0, 8.0))
    onset = float(rng.uniform(90.0, 150.0))
    size, right = FAULTS[kind]
    shift = Shift(seed, Disturbance(kind, size), onset, (w,), 220.0)
    if kind == "bias_jump":  # the simulator has an instant of its own for it
        direction = _direction(seed)
        onset = (220.0 + 30.0 + 10.0) * (0.25 + 0.5 * abs(direction))
        shift = Shift(seed, Disturbance(kind, size), 0.0, (w,), 220.0)
    report = first_alarm(list(watch(shift)))
    if report is None:
        return kind, None, "", "missed"
    named = report.fresh[0].suspects
    verdict = "right" if named and named[0] in right else "among rivals" if right & set(named) else "wrong"
    return kind, report.time - onset, " or ".join(named) or "none", verdict


def _direction(seed: int) -> float:
    draw = np.random.default_rng([seed, 1]).standard_normal(3)
    return float(draw[0] / np.linalg.norm(draw))


def main() -> int:
    parser = arguments("./rig bench watch", __doc__)
    parser.add_argument("--hours", type=int, default=1, help="without a fault")
    parser.add_argument("--faults", type=int, default=20, help="runs in which one enters")
    parser.add_argument("--first-seed", type=int, default=1, help="another one gives fresh sessions")
    options = parser.parse_args()
    begin, seeds = time.monotonic(), range(options.first_seed, options.first_seed + options.faults)
    kinds = list(FAULTS)
    jobs = [(seed, kinds[i % len(kinds)]) for i, seed in enumerate(seeds)]
    with Pool(os.cpu_count()) as pool:
        faults = list(track(pool.imap(fault, jobs), "faults", len(jobs), transient=True))
        hours = range(options.first_seed, options.first_seed + options.hours)
        quiet = list(track(pool.imap(quiet_hour, hours), "quiet hours", options.hours, transient=True))
    late = 0
    for kind in kinds:
        mine = [f for f in faults if f[0] == kind]
        delays = [f[1] for f in mine if f[1] is not None]
        late += sum(f[1] is None or not 0.0 < f[1] <= SOON_S for f in mine)
        verdicts = ", ".join(
            f"{sum(f[3] == v for f in mine)} {v}" for v in ("right", "among rivals", "wrong", "missed")
        )
        worst = f"after {np.median(delays):.0f} s, {max(delays):.0f} s at worst" if delays else "never"
        print(f"{kind:15} reported {worst}; {verdicts}; named {', '.join(sorted({f[2] for f in mine}))}")
    alarms = [alarm for _, found in quiet for alarm in found]
    print(f"{sum(h for h, _ in quiet):.2f} h without an effect: {len(alarms)} alarms", *alarms, sep="\n  ")
    print(f"{time.monotonic() - begin:.0f} s")
    print("targets met" if not late and not alarms else "TARGETS MISSED")
    return 1 if late or alarms else 0


if __name__ == "__main__":
    sys.exit(main())
