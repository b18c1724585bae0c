"""Run in a mount namespace, on a file system of some kilobytes: what a command says and leaves when the disk is full.

python -m tests.malformed.full_disk WHAT FOLDER
"""

from __future__ import annotations

import sys
from pathlib import Path

from tests.fusion import report_results

from gsense_fusion import replay
from gsense_fusion.cli import guarded
from gsense_fusion.closing import result_files, write_files
from gsense_fusion.many.folder import commit, locked, read_record
from gsense_fusion.many.work import Outcome, State
from gsense_rig import simulate


def close_loop(out: Path, _material: Path) -> int:
    files = result_files(report_results.nothing_missing())
    return guarded("close_loop", out, out, lambda: print(write_files(files, out)))


def many(out: Path, _material: Path) -> int:
    """The second report has no room; the first stays, and its earlier version, too."""
    files = result_files(report_results.nothing_missing())

    def work() -> None:
        with locked(out):
            for number in range(40):
                commit(out, Outcome(f"s{number}", State.DONE, key="k", start_ns=0, files=files))

    code = guarded("many", out, out, work)
    names = [p.name for p in out.iterdir() if not p.name.startswith(".")]
    assert names, "not even one"
    assert all(read_record(out, name) is not None for name in names), "half a report"
    return code


def simulated(out: Path, material: Path) -> int:
    return simulate.main([str(material / "plan.yaml"), "--out", str(out)])


def replayed(out: Path, material: Path) -> int:
    return replay.main([str(material / "mcap"), "--filters", "madgwick", "mahony", "--out", str(out)])


WHAT = {"close_loop": close_loop, "many": many, "simulate": simulated, "replay": replayed}


def main() -> int:
    what, folder, material = sys.argv[1:]
    out = Path(folder) / "out"
    code = WHAT[what](out, Path(material))
    print("left:", sorted(str(p.relative_to(out)) for p in out.rglob("*") if p.is_file()) if out.exists() else [])
    return code


if __name__ == "__main__":
    sys.exit(main())
