"""The list of tests that wait for real time names files that are there, and all that start a graph."""

from __future__ import annotations

import re
from pathlib import Path

from tests.scheduling import LONG, REAL_TIME

ROOT = Path(__file__).resolve().parents[2]
FILES = {file.relative_to(ROOT).as_posix(): file for file in ROOT.glob("tests/**/test_*.py")}


def test_every_place_is_there() -> None:
    assert [place for place in (*REAL_TIME, *LONG) if not any(name.startswith(place) for name in FILES)] == []


def test_what_starts_nodes_runs_alone() -> None:
    starts = re.compile(r"mark\.graph\b|usefixtures\(\"domain\"\)")
    missing = [
        name for name, file in FILES.items() if starts.search(file.read_text()) and not name.startswith(REAL_TIME)
    ]
    assert missing == []
