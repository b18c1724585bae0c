"""Campaigns and reports under a folder. Reads only; what cannot be read is shown as such."""

from __future__ import annotations

import itertools
import json
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gsense_rig.campaign.index import DONE, INDEX, CampaignIndexError, read_index

DEPTH = 4  # folders below the one that is given
MAX_FOLDERS = 5000
MAX_LISTED = 50
MAX_JSON = 20_000_000  # bytes
RECORDING_WITHIN = 30.0  # s; a bag that has not changed for so long was given up
UNFINISHED = ".unfinished"  # where a campaign keeps the bag that it records


@dataclass(frozen=True)
class CampaignSeen:
    """One index.yaml."""

    path: str
    changed: float  # s since the epoch
    plan: str = ""
    unit_id: str = ""
    done: int = 0
    total: int = 0
    recording: str = ""
    """The run that is being recorded; empty: none."""
    next_run: str = ""
    problem: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain types."""
        return dict(vars(self))


@dataclass(frozen=True)
class ReportSeen:
    """One page that a command of gsense has written, beside a JSON file of the same name."""

    path: str
    """Relative to the folder, with `/`: its address on the server too."""
    changed: float  # s since the epoch
    kind: str
    """From the file's schema: `close-loop`, `compare`."""
    text: str

    def to_dict(self) -> dict[str, Any]:
        """Plain types."""
        return dict(vars(self))


@dataclass(frozen=True)
class FolderSeen:
    """What lies in the folder; the newest first."""

    campaigns: tuple[CampaignSeen, ...] = ()
    reports: tuple[ReportSeen, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain types; `left_out` are those beyond MAX_LISTED of each."""
        return {
            "campaigns": [campaign.to_dict() for campaign in self.campaigns[:MAX_LISTED]],
            "reports": [report.to_dict() for report in self.reports[:MAX_LISTED]],
            "left_out": sum(max(0, len(found) - MAX_LISTED) for found in (self.campaigns, self.reports)),
        }


class Folder:
    """A folder that is looked into again and again: a file that has not changed is not read again."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self._read: dict[Path, tuple[tuple[int, int], Any]] = {}

    def look(self) -> FolderSeen:
        """What is there now."""
        campaigns, reports = [], []
        for folder, files in _walk(self.root):
            if INDEX in files:
                seen = self._once(folder / INDEX, lambda file: _campaign(self.root, file))
                campaigns.append(replace(seen, recording=_recording(folder)))
            for page in sorted(name for name in files if name.endswith(".html") and not (folder / name).is_symlink()):
                document = f"{page.removesuffix('.html')}.json"
                words = self._once(folder / document, _report_words) if document in files else None
                if words is not None:
                    reports.append(ReportSeen(_name(self.root, folder / page), _changed(folder / page), *words))
        campaigns.sort(key=lambda entry: -entry.changed)
        reports.sort(key=lambda entry: -entry.changed)
        return FolderSeen(tuple(campaigns), tuple(reports))

    def _once(self, file: Path, read: Callable[[Path], Any]) -> Any:
        """`read(file)`, or what it gave when the file was the same."""
        try:
            status = file.stat()
            state = status.st_mtime_ns, status.st_size
        except OSError:
            state = 0, 0
        known = self._read.get(file)
        if known is None or known[0] != state:
            known = self._read[file] = state, read(file)
        return known[1]


def _walk(root: Path) -> Iterator[tuple[Path, set[str]]]:
    """Folders and their files, hidden ones left out, links not followed."""
    for place, folders, files in itertools.islice(os.walk(root), MAX_FOLDERS):
        here = Path(place)
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        if len(here.relative_to(root).parts) >= DEPTH:
            folders.clear()
        yield here, set(files)


def _name(root: Path, path: Path) -> str:
    return path.relative_to(root).as_posix()


def _changed(file: Path) -> float:
    try:
        return file.stat().st_mtime
    except OSError:
        return 0.0


def _campaign(root: Path, file: Path) -> CampaignSeen:
    name, changed = _name(root, file.parent), _changed(file)
    try:
        index = read_index(file.parent)
    except (CampaignIndexError, ValueError, AttributeError) as error:
        return CampaignSeen(name, changed, problem=" ".join(str(error).split()))
    pending = [entry.bag for entry in index.runs if entry.state != DONE]
    return CampaignSeen(
        path=name,
        changed=changed,
        plan=str(index.plan),
        unit_id=str(index.unit_id),
        done=len(index.runs) - len(pending),
        total=len(index.runs),
        next_run=pending[0] if pending else "",
    )


def _recording(folder: Path) -> str:
    """Name of the run whose bag is not closed yet, and grows."""
    try:
        bags = sorted(entry for entry in (folder / UNFINISHED).iterdir() if entry.name.startswith("run_"))
        newest = max(_changed(file) for file in (bags[-1], *bags[-1].iterdir())) if bags else 0.0
    except OSError:
        return ""
    return bags[-1].name if time.time() - newest < RECORDING_WITHIN else ""


def _report_words(document: Path) -> tuple[str, str] | None:
    """Kind and line of a report; None where this is no document of ours."""
    try:
        if document.stat().st_size > MAX_JSON:
            return None
        data = json.loads(document.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    schema = data.get("schema") if isinstance(data, dict) else None
    if not isinstance(schema, str) or not schema.startswith("gsense-"):
        return None
    kind = schema.removeprefix("gsense-").partition("/")[0]
    return kind, _words(data) if kind == "close-loop" else kind.replace("-", " ")


def _words(data: dict[str, Any]) -> str:
    """Verdict and findings of a closed loop in a line."""
    verdict = str(data.get("verdict", "")).replace("_", " ")
    findings = data.get("findings")
    names = [str(found.get("effect", "")) for found in findings if isinstance(found, dict)] if isinstance(
        findings, list
    ) else []  # fmt: skip
    head = " ".join(part for part in (str(data.get("sensor", "")), str(data.get("unit_id") or "")) if part)
    return f"{head}: {verdict}" + (f" ({', '.join(names)})" if names else "")
