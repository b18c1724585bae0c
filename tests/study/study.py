"""The long identification study: many simulated sessions through `close_loop`, and the table of what it got right.

    ./rig study [--sessions N] [--each N] [--jobs 2] [--rate 200] [--out FILE.jsonl]
    ./rig study --quick      a few sessions in about a minute; fails where one is wrong

Outcomes are appended to FILE as they come; a study that was interrupted goes on where it stopped.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from pathlib import Path

for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")  # the sessions run in parallel, not the small matrices of each
ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "src" / "gsense_fusion")]

from rich.console import Console  # noqa: E402
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn  # noqa: E402
from tests.developer import arguments  # noqa: E402
from tests.study.cases import Case, make_cases, quick_cases  # noqa: E402
from tests.study.judge import Outcome, judge  # noqa: E402
from tests.study.table import show  # noqa: E402


def main() -> int:
    """Run the study and print its table."""
    a = _arguments()
    console = Console(width=None if sys.stdout.isatty() else 150)
    cases = quick_cases() if a.quick else make_cases(a.sessions, a.each, a.rate, a.first_seed, a.plan)
    if a.only:
        cases = [c for c in cases if c.group in a.only or c.label in a.only]
    if a.energies:
        cases = [c for c in cases if c.energy in a.energies]
    outcomes = _earlier(a.out, cases)
    done = {_key(o.label, o.energy, o.seed) for o in outcomes}
    todo = [c for c in cases if _key(c.label, c.energy, c.seed) not in done]
    a.out.parent.mkdir(parents=True, exist_ok=True)
    if a.out.is_file() and a.out.read_bytes()[-1:] not in (b"", b"\n"):
        with a.out.open("a", encoding="utf-8") as file:
            file.write("\n")  # a study that was killed in the middle of a line
    columns = (TextColumn("sessions"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with a.out.open("a", encoding="utf-8") as file, Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=len(cases), completed=len(outcomes))
        for outcome in _outcomes(todo, a.jobs):
            outcomes.append(outcome)
            file.write(json.dumps(asdict(outcome)) + "\n")
            file.flush()
            bar.advance(task)
    show(outcomes, console)
    console.print(f"outcomes: {a.out}")
    failed = any(o.verdict == "error" or (a.quick and _wrong(o)) for o in outcomes)
    return 1 if failed else 0


def _arguments() -> argparse.Namespace:
    parser = arguments("./rig study", __doc__)
    parser.add_argument("--sessions", type=int, default=300, help="null sessions")
    parser.add_argument("--each", type=int, default=20, help="sessions for each effect and energy")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--rate", type=float, default=200.0, help="sample rate in Hz")
    parser.add_argument("--first-seed", type=int, default=0, help="another one gives fresh sessions")
    parser.add_argument("--plan", choices=("sweep", "turned"), default="sweep", help="turned: with the board turned")
    parser.add_argument("--energies", nargs="*", type=float, default=[], help="whitened energies: 40, 400, 4000, 40000")
    parser.add_argument("--only", nargs="*", default=[], help="groups or effects: null, single, rail_curvature, ...")
    parser.add_argument(
        "--quick", action="store_true", help="a few sessions in about a minute; fails where one is wrong"
    )
    parser.add_argument("--out", type=Path, default=None, help="outcomes, one JSON a line")
    a = parser.parse_args()
    if a.out is None:
        name = "quick" if a.quick else f"{a.plan}_{a.rate:g}hz_{a.first_seed}"
        a.out = ROOT / "out" / "study" / f"outcomes_{name}.jsonl"
    if a.quick:
        a.out.unlink(missing_ok=True)  # it tests this code, not that of an earlier day
    return a


def _wrong(outcome: Outcome) -> bool:
    """Whether a session was judged wrong; what the catalogue cannot name is flagged, with no claim beside the flag."""
    return outcome.wrong or not outcome.within_rivals


def _key(label: str, energy: float, seed: int) -> tuple[str, float, int]:
    return label, energy, seed


def _earlier(path: Path, cases: list[Case]) -> list[Outcome]:
    if not path.is_file():
        return []
    wanted = {_key(c.label, c.energy, c.seed) for c in cases}
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        try:
            found.append(Outcome(**json.loads(line)))
        except (TypeError, ValueError) as error:
            print(f"{path}:{number}: no outcome of this version ({error}): done again", file=sys.stderr)
    return [o for o in found if _key(o.label, o.energy, o.seed) in wanted]


def _outcomes(cases: list[Case], jobs: int) -> Iterator[Outcome]:
    if jobs <= 1:
        yield from (judge(c) for c in cases)
        return
    with ProcessPoolExecutor(jobs) as pool:
        for future in as_completed([pool.submit(judge, c) for c in cases]):
            yield future.result()


if __name__ == "__main__":
    sys.exit(main())
