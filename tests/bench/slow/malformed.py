"""A thousand malformed bags, plans, indices, compensation, manifest, report and effects files through the commands.

./rig bench malformed [--cases 1000] [--seed 1] [--first 0] [--processes 40]

Each must be answered by a valid result or by exit 2 and one line, with nothing half-written; `tests/malformed/cases.py`
says what is drawn and judged. All cases run in this process, under a limit of memory; a sample of them as processes.
"""

from __future__ import annotations

import argparse
import os
import resource
import sys
import tempfile
from collections import Counter
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), *(str(ROOT / "src" / name) for name in ("gsense_driver", "gsense_rig", "gsense_fusion"))]
os.environ["PYTHONPATH"] = os.pathsep.join([*sys.path[:4], os.environ.get("PYTHONPATH", "")])

from rich.progress import track  # noqa: E402
from tests.malformed.cases import Material, Verdict, run_case  # noqa: E402

MEMORY = 8 << 30
"""Bytes of address space."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--processes", type=int, default=40)
    options = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    numbers = range(options.first, options.first + options.cases)
    some = numbers[:: max(1, options.cases // options.processes)] if options.processes else range(0)
    with tempfile.TemporaryDirectory(prefix="gsense-malformed-") as name:
        material = Material.make(Path(name) / "material")
        place = Path(name) / "case"
        found = [run_case(n, options.seed, material, place) for n in track(numbers, "in process", transient=True)]
        alone = [
            run_case(n, options.seed, material, place, as_process=True)
            for n in track(some, "as processes", transient=True)
        ]
    for title, verdicts in (("in one process", found), ("as processes", alone)):
        tell(title, verdicts)
    bad = [v for v in (*found, *alone) if v.faults]
    for v in bad:
        print(f"case {v.number}, {v.what}, {' '.join(v.command[:2])}: {'; '.join(v.faults)}: {v.line[:300]}")
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
