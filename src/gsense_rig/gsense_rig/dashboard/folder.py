"""Campaigns and reports under a folder. Reads only; what cannot be read is shown as such."""

from __future__ import annotations

import itertools
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gsense_rig.campaign.index import DONE, INDEX, CampaignIndexError, read_index

DEPTH = 4  # folders below the one that is given
MAX_FOLDERS = 5000
MAX_LISTED = 50
MAX_JSON = 20_000_000  # bytes
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
    left_out: int = 0
    """Reports and campaigns that are not listed, for there are too many."""

    def to_dict(self) -> dict[str, Any]:
        """Plain types."""
        return {
            "campaigns": [campaign.to_dict() for campaign in self.campaigns],
            "reports": [report.to_dict() for report in self.reports],
            "left_out": self.left_out,
        }


def look(root: Path) -> FolderSeen:
    """Read what is there now."""
    campaigns, reports = [], []
    for folder, files in _walk(root):
        if INDEX in files:
            campaigns.append(_campaign(root, folder))
        for page in sorted(name for name in files if name.endswith(".html")):
            document = f"{page.removesuffix('.html')}.json"
            seen = _report(root, folder / page, folder / document) if document in files else None
            if seen is not None:
                reports.append(seen)
    campaigns.sort(key=lambda entry: -entry.changed)
    reports.sort(key=lambda entry: -entry.changed)
    left_out = max(0, len(campaigns) - MAX_LISTED) + max(0, len(reports) - MAX_LISTED)
    return FolderSeen(tuple(campaigns[:MAX_LISTED]), tuple(reports[:MAX_LISTED]), left_out)


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


def _campaign(root: Path, folder: Path) -> CampaignSeen:
    name, file = _name(root, folder), folder / INDEX
    try:
        changed = file.stat().st_mtime
    except OSError:
        changed = 0.0
    try:
        index = read_index(folder)
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
        recording=_recording(folder),
        next_run=pending[0] if pending else "",
    )


def _recording(folder: Path) -> str:
    """Name of the run whose bag is not closed yet."""
    try:
        names = sorted(entry.name for entry in (folder / UNFINISHED).iterdir() if entry.name.startswith("run_"))
    except OSError:
        return ""
    return names[-1] if names else ""


def _report(root: Path, page: Path, document: Path) -> ReportSeen | None:
    try:
        changed = page.stat().st_mtime
        if page.is_symlink() or document.stat().st_size > MAX_JSON:
            return None
        data = json.loads(document.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    schema = data.get("schema") if isinstance(data, dict) else None
    if not isinstance(schema, str) or not schema.startswith("gsense-"):
        return None
    kind = schema.removeprefix("gsense-").partition("/")[0]
    return ReportSeen(_name(root, page), changed, kind, _words(data) if kind == "close-loop" else kind)


def _words(data: dict[str, Any]) -> str:
    """Verdict and findings of a closed loop in a line."""
    verdict = str(data.get("verdict", "")).replace("_", " ")
    findings = data.get("findings")
    names = [str(found.get("effect", "")) for found in findings if isinstance(found, dict)] if isinstance(
        findings, list
    ) else []  # fmt: skip
    head = " ".join(part for part in (str(data.get("sensor", "")), str(data.get("unit_id") or "")) if part)
    return f"{head}: {verdict}" + (f" ({', '.join(names)})" if names else "")
