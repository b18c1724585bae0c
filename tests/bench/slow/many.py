"""`close_loop --manifest` over many simulated sessions: wall time against the ideal split, and what it needs of memory.

./rig bench many [--sessions 100] [--jobs N] [--alone 8] [--keep DIR]

The ideal split is the sum of the sessions' times over the number of processes, and never less than the longest one. The
times are those of the same sessions one after the other in one process (`--alone` of them, spread over all sizes), with
nothing else running: what the processes take from one another counts as a loss. The CPU times tell the parts apart also
on a machine that is busy: of a session alone and side by side, and of a call that keeps everything (start, checksums,
summary). What no program can help is measured beside it: how much longer a loop in registers takes when the same loop
runs on every core. Cores that are threads of one core, or one clock's budget, show there.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_rig"), str(ROOT / "src" / "gsense_fusion")]

import yaml  # noqa: E402
from tests.developer import arguments  # noqa: E402

from gsense_rig.campaign.plan import Plan, PlanRun  # noqa: E402
from gsense_rig.campaign.session import SessionSpec  # noqa: E402
from gsense_rig.campaign.simulate import simulate_campaign  # noqa: E402

TARGET = 1.2
DAY = 86400.0
FIRST = 1.77e9
LENGTHS = (12.0, 12.0, 16.0, 24.0)
"""s of each run, in turn: sessions of many sizes."""
EFFECTS = ((), (), ("rail_curvature=0.003",), (), ("temperature_bias=0.0005",))
UNITS = 4


def plan(seconds: float) -> Plan:
    """A rest, three sines, and two with the board turned."""
    runs = [PlanRun("static", seconds)]
    runs += [
        PlanRun("sine", seconds, 0.15, w, mounting, role=role)
        for w, mounting, role in (
            (3.0, "0", "fit"),
            (8.0, "0", "fit"),
            (6.0, "0", "held_out"),
            (4.0, "180", "fit"),
            (7.0, "180", "fit"),
        )
    ]
    return Plan("many", tuple(runs))


def make(job: tuple[int, Path]) -> None:
    """One session, where it is not there yet."""
    number, folder = job
    unit = number % UNITS
    spec = SessionSpec(number + 1, EFFECTS[number % len(EFFECTS)], 900 + unit, FIRST + DAY * number, f"unit-{unit}")
    simulate_campaign(plan(LENGTHS[number % len(LENGTHS)]), folder, spec)


def call(folder: Path, out: Path, sessions: list[int], jobs: int) -> tuple[float, list[float], float]:
    """Analyse some sessions with so many processes; wall time, the time of each, CPU time of all, s."""
    manifest = out.with_suffix(".yaml")
    manifest.write_text(yaml.safe_dump({"entries": [{"campaign": str(folder / f"session_{n:03d}")} for n in sessions]}))
    command = [sys.executable, "-m", "gsense_fusion.close_loop", "--manifest", str(manifest), "--out", str(out)]
    begun, used = time.perf_counter(), cpu_of_children()
    subprocess.run([*command, "--jobs", str(jobs)], check=True, stdout=subprocess.DEVNULL)
    wall, used = time.perf_counter() - begun, cpu_of_children() - used
    entries = json.loads((out / "summary.json").read_text())["entries"]
    return wall, [entry["seconds"] for entry in entries], used


def cpu_of_children() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def spin(_number: int) -> float:
    """CPU time of a loop that touches no memory, s."""
    begun, value = time.process_time(), 1
    for _ in range(20_000_000):
        value = (value * 5 + 1) & 0xFFFF
    return time.process_time() - begun


def slower_together(jobs: int) -> float:
    """How much longer the loop takes on all cores at once than on one."""
    with multiprocessing.get_context("spawn").Pool(jobs) as pool:
        together = max(pool.map(spin, range(jobs), chunksize=1))
    return together / spin(0)


def main() -> int:
    parser = arguments("./rig bench many", __doc__)
    parser.add_argument("--sessions", type=int, default=100, help="simulated")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at a time")
    parser.add_argument("--alone", type=int, default=8, help="sessions done one after the other, for the ideal split")
    parser.add_argument("--keep", type=Path, help="where the sessions go, and stay")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="gsense-many-") as name:
        folder = (options.keep or Path(name)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        everything = list(range(options.sessions))
        with multiprocessing.get_context("spawn").Pool(options.jobs) as pool:
            pool.map(make, [(n, folder / f"session_{n:03d}") for n in everything], chunksize=1)
        step = max(1, options.sessions // options.alone) | 1  # odd: all lengths come up
        some = everything[::step]
        _, alone, cpu_alone = call(folder, Path(name) / "alone", some, 1)
        wall, together, cpu = call(folder, Path(name) / "together", everything, options.jobs)
        again, _, cpu_again = call(folder, Path(name) / "together", everything, options.jobs)
    expected = sum(together) * sum(alone) / sum(together[n] for n in some)
    ideal = max(expected / options.jobs, *together)
    ratio = wall / ideal
    span = f"{min(alone):.2f} to {max(alone):.2f} s"
    print(f"{options.sessions} sessions, {options.jobs} processes: {wall:.1f} s; one alone {span}")
    print(f"ideal split of {expected:.1f} s: {ideal:.1f} s; wall time {ratio:.2f} times that (target {TARGET:g})")
    slower = slower_together(options.jobs)
    print(f"a loop in registers takes {slower:.2f} times as long on {options.jobs} cores at once as on one")
    print(f"against the times that the sessions took side by side: {wall * options.jobs / sum(together):.2f}")
    print(f"the same command again, everything kept: {again:.1f} s")
    start = cpu_again / (options.jobs + 1)  # of the command and of each worker alike
    each = ((cpu_alone - 2 * start) / len(alone), (cpu - cpu_again) / len(together))
    print(
        f"CPU time of a session: {each[0]:.2f} s alone, {each[1]:.2f} s side by side; {start:.1f} s to start a process"
    )
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
    print(f"largest process: {peak:.0f} MB")
    return 0 if ratio <= TARGET else 1


if __name__ == "__main__":
    sys.exit(main())
