"""docs/interfaces.md is what the code says."""

from __future__ import annotations

from pathlib import Path

from reference.page import page

PAGE = Path(__file__).resolve().parents[2] / "docs" / "interfaces.md"


def test_the_page_is_up_to_date() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(), "stale: ./rig exec python tools/interfaces.py writes it anew"
