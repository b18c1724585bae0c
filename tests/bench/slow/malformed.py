"""A thousand malformed bags, plans, indices, compensation, manifest, report and effects files through the commands.

./rig bench malformed [--cases 1000] [--seed 1] [--first 0] [--processes 40] [--jobs N]

Each must be answered by a valid result or by exit 2 and one line, with nothing half-written; `tests/malformed/cases.py`
says what is drawn and judged. The cases run in forks of this process, under a limit of memory; a sample of them by the
commands themselves.
"""

from __future__ import annotations

import os
import resource
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), *(str(ROOT / "src" / name) for name in ("gsense_driver", "gsense_rig", "gsense_fusion"))]
from tests.developer import arguments  # noqa: E402

os.environ["PYTHONPATH"] = os.pathsep.join([*sys.path[:4], os.environ.get("PYTHONPATH", "")])

from rich.progress import track  # noqa: E402
from tests.malformed.answers import Verdict  # noqa: E402
from tests.malformed.cases import Material, run_case  # noqa: E402
from tests.malformed.workers import run_cases  # noqa: E402

MEMORY = 8 << 30
"""Bytes of address space."""
WARM = 12
_ALL = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)


def main() -> int:
    parser = arguments("./rig bench malformed", __doc__)
    parser.add_argument("--cases", type=int, default=1000, help="malformed inputs")
    parser.add_argument("--seed", type=int, default=1, help="of what is drawn")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--processes", type=int, default=40, help="cases done once more as a process each")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes at a time")
    options = parser.parse_args()
    begun = time.perf_counter()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    numbers = range(options.first, options.first + options.cases)
    sample = numbers[:: max(1, options.cases // options.processes)] if options.processes else range(0)
    with tempfile.TemporaryDirectory(prefix="gsense-malformed-") as name:
        material = Material.make(Path(name) / "material")
        for number in range(WARM):  # what is loaded and compiled once, before the forks
            run_case(number, 0, material, Path(name) / "warm")
        found, alone = (
            list(
                track(
                    run_cases(some, options.seed, material, Path(name), options.jobs, as_process=as_process),
                    title,
                    len(some),
                    transient=True,
                )
            )
            for title, some, as_process in (("in forks", numbers, False), ("as processes", sample, True))
        )
    for title, verdicts in (("in forks", found), ("as processes", alone)):
        tell(title, verdicts)
    bad = [v for v in (*found, *alone) if v.faults]
    for v in bad:
        print(f"case {v.number}, {v.what}, {' '.join(v.command[:2])}: {'; '.join(v.faults)}: {v.line[:300]}")
    took, used = time.perf_counter() - begun, sum(resource.getrusage(who)[k] for who in _ALL for k in (0, 1))
    print(f"{took / 60:.1f} min with {options.jobs} processes, {used / 60:.1f} min of CPU time", end="")
    print(f", load {os.getloadavg()[0]:.1f}")
    print(f"{len(bad)} answers are wrong")
    return 1 if bad else 0


def tell(title: str, verdicts: list[Verdict]) -> None:
    """How many of each command were answered how."""
    print(f"{len(verdicts)} malformed inputs, {title}:")
    for command in sorted({v.command[0] for v in verdicts}):
        codes = Counter(v.code for v in verdicts if v.command[0] == command)
        words = {0: "a valid result", 1: "some sessions failed", 2: "one line and exit 2"}
        print(f"  {command}: {', '.join(f'{n} {words.get(c or 0, c)}' for c, n in sorted(codes.items(), key=str))}")


if __name__ == "__main__":
    sys.exit(main())
