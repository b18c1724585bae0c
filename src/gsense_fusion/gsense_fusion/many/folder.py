"""The folder of many sessions: a folder for each report, which appears whole or not at all, and what is known of it."""

from __future__ import annotations

import fcntl
import json
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from gsense_fusion.closing import REPORT_HTML, REPORT_JSON, write_files
from gsense_fusion.compensation.document import write_atomically

from .entries import Session
from .manifest import ManifestError
from .work import Outcome

ENTRY, SCHEMA = "entry.json", "gsense-entry/1"
SUMMARY_JSON, SUMMARY_HTML = "summary.json", "summary.html"
WORK = ".unfinished"
LOCK = ".lock"
RESERVED = frozenset({SUMMARY_JSON, SUMMARY_HTML})


@dataclass(frozen=True)
class Record:
    """What the folder knows of a report that is done."""

    key: str
    seconds: float
    start_ns: int | None


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """The folder, made where it is missing, for this command alone.

    Raises:
        ManifestError: another command works in it.
        OSError: it cannot be made or written.
    """
    if folder.exists() and not folder.is_dir():
        raise ManifestError(f"{folder}: is a file; give a folder")
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / LOCK).open("w") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise ManifestError(f"{folder}: another close_loop works in it; wait for its end") from error
        shutil.rmtree(folder / WORK, ignore_errors=True)
        yield
        shutil.rmtree(folder / WORK, ignore_errors=True)


def check_free(folder: Path, sessions: Sequence[Session]) -> None:
    """Raises ManifestError where a session would replace something that is no report of an earlier call."""
    for session in sessions:
        path = folder / session.name
        if session.name in RESERVED or (path.exists() and not (path / ENTRY).is_file()):
            raise ManifestError(f"{path}: is in the way and no report of an earlier call; move it, or rename the entry")


def read_record(folder: Path, name: str) -> Record | None:
    """What is known of a report; None where it is not there whole."""
    try:
        content: Any = json.loads((folder / name / ENTRY).read_text(encoding="utf-8"))
        whole = all((folder / name / file).is_file() for file in (REPORT_JSON, REPORT_HTML))
        if not whole or content["schema"] != SCHEMA:
            return None
        start = content["start_ns"]
        return Record(str(content["key"]), float(content["seconds"]), None if start is None else int(start))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def commit(folder: Path, outcome: Outcome) -> None:
    """Put a report in its place, in that of an earlier one; raises OSError, and then leaves the earlier one."""
    work = folder / WORK / outcome.name
    shutil.rmtree(work, ignore_errors=True)
    try:
        write_files(outcome.files, work)
        start = outcome.start_ns
        record = {
            "schema": SCHEMA,
            "key": outcome.key,
            "seconds": outcome.seconds,
            "start_ns": start,
            "start": None if start is None else iso(start),
        }
        write_atomically(work / ENTRY, json.dumps(record, indent=1) + "\n")
    except OSError:
        shutil.rmtree(work, ignore_errors=True)
        raise
    place, former = folder / outcome.name, folder / WORK / f"{outcome.name}.former"
    if place.exists():
        place.rename(former)
    work.rename(place)
    shutil.rmtree(former, ignore_errors=True)


def iso(stamp_ns: int) -> str:
    """A stamp as ISO 8601, UTC."""
    return datetime.fromtimestamp(stamp_ns * 1e-9, tz=timezone.utc).isoformat(timespec="seconds")
