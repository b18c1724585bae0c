"""`close_loop --manifest FILE --out DIR [--jobs N] [--scheduler ADDRESS]`: wires the parts, shows how far it is."""

from __future__ import annotations

import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from gsense_driver.user_input.interruption import Interruption
from gsense_fusion.cli import one_line as error_line
from gsense_fusion.closing import REPORT_JSON
from gsense_fusion.comparison.snapshot import load_snapshot
from gsense_fusion.compensation.document import write_atomically
from gsense_fusion.identification.types import IdentificationError

from .cluster import ClusterError, run_on_cluster
from .document import summary_json
from .entries import Session, find_sessions
from .folder import SUMMARY_HTML, SUMMARY_JSON, check_free, commit, locked, read_record
from .local import default_jobs, run_locally
from .manifest import Choices, ManifestError, parse_manifest
from .overview import Overview, Row, overview
from .page import one_line, summary_html
from .work import Job, Outcome, State, failed

LEAST_SIZE = 100_000
"""Bytes that every session counts for in the bar: what it takes however small it is."""
STOPPED, UNUSABLE, INTERRUPTED = 1, 2, 130


@dataclass(frozen=True)
class Options:
    """What the command line says."""

    manifest: Path
    out: Path
    choices: Choices
    jobs: int | None = None
    """Workers on this machine; None: as many as it bears."""
    scheduler: str | None = None
    """Address of a Dask scheduler."""


def run_many(options: Options, console: Console) -> int:
    """Analyse all sessions of a manifest; one line on stderr for what goes wrong.

    Returns:
        Exit code 0; 1 where a session failed or the cluster was lost; 2 for a manifest or folder that cannot be used;
        130 after Ctrl-C.
    """
    try:
        return _run(options, console)
    except (ManifestError, IdentificationError) as error:
        return _say(str(error), UNUSABLE)
    except ClusterError as error:
        return _say(str(error), STOPPED)
    except KeyboardInterrupt:
        return _say(f"interrupted; the same command goes on in {options.out}", INTERRUPTED)
    except OSError as error:
        path = error.filename or options.out
        return _say(f"{path}: {error.strerror or error}; what was done stays, the same command goes on", UNUSABLE)


def _run(options: Options, console: Console) -> int:
    sessions = _sessions(options)
    with Interruption(), locked(options.out):
        check_free(options.out, sessions)
        outcomes: dict[str, Outcome] = {}
        try:
            with closing(_progress(_outcomes(options, sessions), sessions, console)) as coming:  # type: ignore[type-var]
                for outcome in coming:
                    if outcome.state is State.DONE:
                        commit(options.out, outcome)
                    outcomes[outcome.name] = outcome
        finally:
            with _uninterrupted():
                view = _summarise(options, sessions, outcomes)
    console.print(one_line(view), markup=False, soft_wrap=True)
    for name in (SUMMARY_JSON, SUMMARY_HTML):
        console.print(str(options.out / name), markup=False, soft_wrap=True)
    return STOPPED if view.states.get(State.FAILED.value) else 0


def _sessions(options: Options) -> list[Session]:
    path = options.manifest
    try:
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise ManifestError(f"{path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ManifestError(f"{path}: is not UTF-8 text ({error.reason} at byte {error.start})") from error
    return find_sessions(parse_manifest(text, path, options.choices), path.parent)


def _outcomes(options: Options, sessions: Sequence[Session]) -> Iterator[Outcome]:
    """Outcomes as they come: the longest first, so that none is still busy when all others are done."""
    records = {s.name: read_record(options.out, s.name) for s in sessions}
    jobs = []
    for session in sorted(sessions, key=lambda s: -s.size):
        record = records[session.name]
        job = Job(session, None if record is None else record.key)
        if session.problem is not None:
            yield failed(job, session.problem)
        else:
            jobs.append(job)
    largest = max((job.session.size for job in jobs), default=0)
    run = (
        run_locally(jobs, options.jobs or default_jobs(largest))
        if options.scheduler is None
        else run_on_cluster(jobs, options.scheduler)
    )
    with closing(run):  # type: ignore[type-var] # both are generators
        yield from run


def _progress(outcomes: Iterator[Outcome], sessions: Sequence[Session], console: Console) -> Iterator[Outcome]:
    """The same, with a bar by the size of the bags and a line for each session."""
    sizes = {s.name: s.size + LEAST_SIZE for s in sessions}
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    screen = Console(stderr=True)
    done = bad = 0
    with closing(outcomes), Progress(*columns, console=screen, transient=True, disable=not screen.is_terminal) as bar:  # type: ignore[type-var]
        task = bar.add_task(f"0 of {len(sessions)}", total=sum(sizes.values()))
        for outcome in outcomes:
            yield outcome
            done, bad = done + 1, bad + (outcome.state is State.FAILED)
            text = {State.FAILED: f"failed: {outcome.reason}", State.KEPT: "kept"}.get(outcome.state, outcome.sentence)
            console.print(f"{outcome.name}: {text}", markup=False, soft_wrap=True)
            words = f"{done} of {len(sessions)}" + (f", {bad} failed" if bad else "")
            bar.update(task, advance=sizes[outcome.name], description=escape(words))


def _summarise(options: Options, sessions: Sequence[Session], outcomes: dict[str, Outcome]) -> Overview:
    """Write the summary over all that is there."""
    view = overview([_row(options.out, s.name, outcomes.get(s.name)) for s in sessions])
    write_atomically(options.out / SUMMARY_JSON, summary_json(view))
    write_atomically(options.out / SUMMARY_HTML, summary_html(view))
    return view


def _row(out: Path, name: str, outcome: Outcome | None) -> Row:
    if outcome is None:
        return Row(name, State.PENDING)
    record = read_record(out, name)
    if outcome.state is State.FAILED or record is None:
        return Row(name, State.FAILED, outcome.reason or "its report is not there any more")
    report = load_snapshot(out / name / REPORT_JSON)
    return Row(name, outcome.state, "", report, record.start_ns, record.seconds)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """A second Ctrl-C waits for the summary."""
    before = {number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _say(message: str, code: int) -> int:
    sys.stderr.write(f"close_loop: {error_line(message)}\n")
    return code
