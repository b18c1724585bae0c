"""`close_loop --compare` on simulated sessions of one unit: how often it sees a change that is none, and misses one.

./rig bench compare [--sessions 24] [--first-seed 1]
"""

from __future__ import annotations

import os

for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")

import itertools  # noqa: E402
import sys  # noqa: E402
import time  # noqa: E402
from collections.abc import Sequence  # noqa: E402
from dataclasses import replace  # noqa: E402
from multiprocessing import Pool  # noqa: E402
from pathlib import Path  # noqa: E402

import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from rich.progress import track  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.fusion.identification.sessions import BASE, BOW, SETTINGS, G  # noqa: E402
from tests.study.judge import analyse  # noqa: E402
from tests.study.simulator import Disturbance, simulate  # noqa: E402

from gsense_fusion.comparison.changes import Comparison, Status  # noqa: E402
from gsense_fusion.comparison.differences import compare  # noqa: E402
from gsense_fusion.comparison.snapshot import Snapshot, snapshot  # noqa: E402
from gsense_fusion.comparison.words import one_sentence  # noqa: E402
from gsense_fusion.report.document import report_document  # noqa: E402

REMOUNTED = np.radians(0.3)
"""The same holes: standard deviation of the mounting's angles between sessions, rad."""
SIGMAS = 5.0
"""Of the least sure of the sessions."""
Job = tuple[int, float, tuple[Disturbance, ...]]


def report(job: Job) -> Snapshot:
    """The report of one session: its seed, what k has drifted by, (rad/s)/(m/s^2), and what entered."""
    seed, drift, disturbances = job
    g = np.array(G) + drift * np.roll(np.eye(3), 1, axis=1)
    rows = tuple(tuple(float(x) for x in row) for row in g)
    session = replace(BASE, seed=seed, g_matrix=rows, mounting_error=REMOUNTED, disturbances=disturbances)
    return snapshot(report_document(analyse(simulate(session), SETTINGS)), f"session {seed}")


def show(name: str, found: Sequence[Comparison], wanted: Sequence[bool]) -> int:
    """Print a row; returns how many are not as wanted."""
    wrong = [one_sentence(c) for c, right in zip(found, wanted, strict=True) if not right]
    print(f"{name:34} {sum(wanted)} of {len(wanted)}", *wrong, sep="\n  ")
    return len(wrong)


def main() -> int:
    parser = arguments("./rig bench compare", __doc__)
    parser.add_argument("--sessions", type=int, default=24, help="of one unit")
    parser.add_argument("--first-seed", type=int, default=1, help="another one gives fresh sessions")
    options = parser.parse_args()
    begin, n = time.monotonic(), options.sessions
    seeds = range(options.first_seed, options.first_seed + n)
    with Pool(os.cpu_count()) as pool:
        plain = list(track(pool.imap(report, [(s, 0.0, ()) for s in seeds]), "nothing changed", n, transient=True))
        nulls = [compare(a, b) for a, b in itertools.pairwise(plain)]
        errors = [c.k.difference.stderr for c in nulls if c.k is not None]
        stderr = float(max(errors))
        drifted: list[Job] = [(s + 1000, SIGMAS * stderr, ()) for s in seeds[: n // 2]]
        bowed: list[Job] = [(s + 2000, 0.0, (BOW,)) for s in seeds[: n // 4]]
        jobs = drifted + bowed
        later = list(track(pool.imap(report, jobs), "something changed", len(jobs), transient=True))
    moved = [compare(a, b) for a, b in zip(plain, later[: len(drifted)], strict=False)]
    entered = [compare(a, b) for a, b in zip(plain, later[len(drifted) :], strict=False)]
    show("nothing changed, said so:", nulls, [c.verdict == "nothing_changed" for c in nulls])
    share = np.mean([_status(c, "g_sensitivity") is Status.DRIFTED for c in moved])
    missed = show(f"k drifted by {SIGMAS:g} standard errors:", moved, [_drift(c) for c in moved])
    bad = show("rail bow entered:", entered, [_status(c, "rail_curvature") is Status.ENTERED for c in entered])
    unit = np.degrees(1.0) * 9.80665
    print(f"standard error of a difference of k: {np.median(errors) * unit:.4f}, at most {stderr * unit:.4f} deg/s/g")
    print(f"{time.monotonic() - begin:.0f} s")
    alarms = sum(c.verdict != "nothing_changed" for c in nulls)
    met = alarms <= max(1, 0.03 * len(nulls)) and share >= 0.9 and not bad
    print(f"{missed} drifts missed, {alarms} false alarms;", "targets met" if met else "TARGETS MISSED")
    return 0 if met else 1


def _status(c: Comparison, effect: str) -> Status | None:
    return next((e.status for e in c.effects if e.effect == effect), None)


def _drift(c: Comparison) -> bool:
    return _status(c, "g_sensitivity") is Status.DRIFTED


if __name__ == "__main__":
    sys.exit(main())
