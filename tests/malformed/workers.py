"""Many cases on forked workers: warm, and a case that ends its process ends no other."""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any

from tests.malformed.answers import Verdict
from tests.malformed.cases import Material, run_case

SLICE = 25
"""Cases that a worker takes before the next one is forked: what a case leaves in memory does not pile up."""
_FORK = multiprocessing.get_context("fork")


@dataclass
class _Worker:
    process: Any
    line: Connection
    todo: deque[int] = field(default_factory=deque)


def run_cases(
    numbers: Sequence[int], seed: int, material: Material, folder: Path, jobs: int, *, as_process: bool = False
) -> Iterator[Verdict]:
    """Verdicts as they come; one for each number, also where the process died over it."""
    slices = deque(deque(numbers[k : k + SLICE]) for k in range(0, len(numbers), SLICE))
    staff: list[_Worker] = []
    started = 0
    while slices or staff:
        while slices and len(staff) < jobs:
            started += 1
            staff.append(_start(slices.popleft(), seed, material, folder / str(started), as_process))
        for line in wait([worker.line for worker in staff]):
            worker = next(w for w in staff if w.line is line)
            try:
                verdict = worker.line.recv()
                worker.todo.remove(verdict.number)
                yield verdict
            except EOFError:
                staff.remove(worker)
                worker.process.join()
                if worker.todo:  # it died over the first of these
                    yield _dead(worker)
                    slices.appendleft(worker.todo)


def _dead(worker: _Worker) -> Verdict:
    code = worker.process.exitcode
    how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
    return Verdict(worker.todo.popleft(), "?", ["?"], faults=[f"its process ended: {how}"])


def _start(numbers: deque[int], seed: int, material: Material, folder: Path, as_process: bool) -> _Worker:
    ours, theirs = _FORK.Pipe(duplex=False)
    process = _FORK.Process(target=_work, args=(theirs, tuple(numbers), seed, material, folder, as_process))
    process.start()
    theirs.close()
    return _Worker(process, ours, numbers)


def _work(
    line: Connection, numbers: Sequence[int], seed: int, material: Material, folder: Path, as_process: bool
) -> None:
    for number in numbers:
        line.send(run_case(number, seed, material, folder, as_process=as_process))
