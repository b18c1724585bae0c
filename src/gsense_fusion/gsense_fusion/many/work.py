"""What a worker does: one session from bags to the texts of its report. Workers read; only the command writes."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass, field, replace
from enum import Enum
from threading import Lock

from gsense_fusion.bags import BagError
from gsense_fusion.cli import one_line
from gsense_fusion.closing import result_files, run_request
from gsense_fusion.identification.types import IdentificationError
from gsense_fusion.report.words import one_sentence

from .entries import Session
from .identity import key_of, program_digest

_ONE = Lock()
"""Matplotlib's settings belong to the process: where a cluster's worker has threads, they take turns."""


class State(str, Enum):
    """What became of a session."""

    DONE = "done"
    KEPT = "kept"
    """Done by an earlier call, and nothing that it rests on has changed."""
    FAILED = "failed"
    PENDING = "pending"
    """Not reached."""


@dataclass(frozen=True)
class Job:
    """A session for a worker."""

    session: Session
    known: str | None = None
    """Key of the report that is there already."""
    program: str = field(default_factory=program_digest)
    """Of who asks."""


@dataclass(frozen=True)
class Outcome:
    """What a worker hands back."""

    name: str
    state: State
    reason: str = ""
    """Why it failed; one line."""
    key: str = ""
    seconds: float = 0.0
    """That the worker spent on it."""
    start_ns: int | None = None
    """Of the earliest sample, since 1970."""
    sentence: str = ""
    files: dict[str, str | None] = field(default_factory=dict)
    """Texts of the report by file name."""


def work(job: Job) -> Outcome:
    """Analyse one session; never raises for what is in its bags."""
    begun = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of numpy: lines that name no session
            outcome = _work(job)
    except (BagError, IdentificationError) as error:
        outcome = failed(job, str(error))
    except OSError as error:
        outcome = failed(job, f"{error.filename or job.session.name}: {error.strerror or error}")
    except MemoryError:
        outcome = failed(job, "not enough memory; fewer --jobs leave each more")
    except Exception as error:  # noqa: BLE001 # one broken session never stops the rest
        what = f"{type(error).__name__}: {error}"
        outcome = failed(
            job, f"the analysis broke down ({what}); `close_loop` on its bags with GSENSE_DEBUG=1 shows where"
        )
    return replace(outcome, seconds=time.perf_counter() - begun)


def failed(job: Job, reason: str) -> Outcome:
    """The outcome of a session that cannot be analysed."""
    return Outcome(job.session.name, State.FAILED, one_line(reason))


def _work(job: Job) -> Outcome:
    session = job.session
    if job.program != program_digest():
        raise IdentificationError(
            "this worker has another version of gsense_fusion than the command; update one of them"
        )
    key = key_of(session.request, session.unit_id)
    if key == job.known:
        return Outcome(session.name, State.KEPT, key=key)
    with _ONE:
        result, runs = run_request(session.request, lambda _text, _part: None)
        if result.unit_id is None:
            result = replace(result, unit_id=session.unit_id)
        elif session.unit_id not in (None, result.unit_id):
            raise IdentificationError(f"the manifest says unit {session.unit_id!r}, the bags say {result.unit_id!r}")
        files = result_files(result)
    start = min(int(run.imu.stamp_ns.min()) for run in runs)
    return Outcome(session.name, State.DONE, key=key, start_ns=start, sentence=one_sentence(result), files=files)
