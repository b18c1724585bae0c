"""Sessions on the processes of this machine, one at a time in each.

A worker that dies (out of memory, a fault in a library) takes its session with it and no other: that is why this is no
pool of the standard library, which ends with its first dead process. A worker whose command was killed ends by itself.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from .work import Job, Outcome, failed, work

MEMORY = 1.2e9
"""Bytes that a worker should find free; it needs 0.3e9 and about ten times the size of its bags."""
PER_BYTE = 10.0
_SPAWN = multiprocessing.get_context("spawn")  # forks of a process with threads may hang


def default_jobs(largest: int) -> int:
    """As many workers as there are cores for this process, and memory for the largest session in each."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    free = _free_memory()
    if free is None:
        return cores
    return max(1, min(cores, int(free / max(MEMORY, 3e8 + PER_BYTE * largest))))


def _free_memory() -> float | None:
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        return next(float(line.split()[1]) * 1024.0 for line in lines if line.startswith("MemAvailable"))
    except (OSError, StopIteration, ValueError):
        return None


@dataclass
class _Worker:
    """A process and the session that it has."""

    process: BaseProcess
    line: Connection
    job: Job | None = None


def run_locally(jobs: Sequence[Job], workers: int) -> Iterator[Outcome]:
    """Outcomes as they come; ends its workers when it is closed, whatever they are at."""
    todo = deque(jobs)
    staff = [_start() for _ in range(min(workers, len(todo)))]
    try:
        for worker in staff:
            _give(worker, todo)
        while busy := [w for w in staff if w.job is not None]:
            ready = wait([w.line for w in busy])
            for place, worker in enumerate(staff):
                if worker.line in ready and worker.job is not None:
                    outcome, alive = _take(worker)
                    if not alive:
                        _end(worker)
                        staff[place] = _start()
                    _give(staff[place], todo)
                    yield outcome
    finally:
        for worker in staff:
            _end(worker)


def _start() -> _Worker:
    ours, theirs = _SPAWN.Pipe()
    process = _SPAWN.Process(target=_serve, args=(theirs,), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process, ours)


def _give(worker: _Worker, todo: deque[Job]) -> None:
    worker.job = todo.popleft() if todo else None
    if worker.job is not None:
        try:
            worker.line.send(worker.job)
        except OSError:  # it died before: `_take` says so
            return


def _take(worker: _Worker) -> tuple[Outcome, bool]:
    """What a worker has to say, and whether it lives."""
    job = worker.job
    assert job is not None  # noqa: S101 # only busy ones are asked
    try:
        return worker.line.recv(), True
    except (EOFError, OSError):
        worker.process.join(5.0)
        code = worker.process.exitcode
        how = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
        memory = ", probably out of memory" if code == -signal.SIGKILL else ""
        return failed(job, f"its process died ({how}{memory})"), False


def _end(worker: _Worker) -> None:
    worker.line.close()
    worker.process.terminate()
    worker.process.join(5.0)
    if worker.process.is_alive():
        worker.process.kill()
        worker.process.join()


def _serve(line: Connection) -> None:
    """The worker: sessions until the line closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the command's; it ends its workers
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    gc.freeze()  # the libraries stay: to look through them again and again takes a tenth of a short session
    try:
        while True:
            line.send(work(line.recv()))
    except (EOFError, OSError):
        return
