"""`close_loop --compare OLD NEW`: reads two reports, or campaigns that it analyses first, and writes what changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from gsense_fusion.campaigns import campaign_bags
from gsense_fusion.compensation.document import write_atomically
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import Role
from gsense_fusion.report.document import report_document

from .console import show
from .differences import compare
from .document import comparison_json
from .page import comparison_html
from .snapshot import Snapshot, load_snapshot, snapshot

REPORT = "report.json"
Analyse = Callable[[list[tuple[Path, Role]]], LoopResult]


def compare_paths(old: Path, new: Path, out: Path | None, analyse: Analyse, console: Console) -> list[Path]:
    """Compare, print, and write compare.json and compare.html into `out` where it is given.

    Args:
        old: A report.json, a folder with one, or a campaign: a folder with index.yaml, a bag or a folder of bags.
        new: The same.
        out: Where the files go.
        analyse: Analyses the bags of a campaign.
        console: Where the table goes.

    Returns:
        The files written.

    Raises:
        IdentificationError: what is named is none of these, or the two are of different sensors; one line.
    """
    found = compare(_snapshot(old, analyse), _snapshot(new, analyse))
    show(found, console)
    if out is None:
        return []
    out.mkdir(parents=True, exist_ok=True)
    written = [out / "compare.json", out / "compare.html"]
    write_atomically(written[0], comparison_json(found))
    write_atomically(written[1], comparison_html(found))
    return written


def _snapshot(path: Path, analyse: Analyse) -> Snapshot:
    if path.is_file() and path.suffix == ".json":
        return load_snapshot(path)
    if (path / REPORT).is_file():
        return load_snapshot(path / REPORT)
    return snapshot(report_document(analyse(campaign_bags(path))), str(path))
