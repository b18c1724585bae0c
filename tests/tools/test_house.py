"""One version everywhere, an entry for it, and the licences of what the set-up installs."""

from __future__ import annotations

import re
from pathlib import Path

import licences
import version

ROOT = Path(__file__).resolve().parents[2]
VERSION = (ROOT / "VERSION").read_text(encoding="utf-8").strip()


def test_one_version_everywhere() -> None:
    found = {}
    for file, pattern in version.places():
        match = re.search(pattern, file.read_text(encoding="utf-8"))
        assert match, file
        if match[1] != version.wanted(pattern, VERSION):
            found[file] = match[1]
    assert found == {}, f"python3 tools/version.py {VERSION} writes it everywhere"


def test_no_setup_has_a_version_of_its_own() -> None:
    for file in ROOT.glob("src/*/setup.py"):
        assert "version=VERSION" in file.read_text(encoding="utf-8")
    assert "VERSION ${GSENSE_VERSION}" in (ROOT / "firmware" / "CMakeLists.txt").read_text(encoding="utf-8")


def test_the_changelog_has_the_version() -> None:
    assert re.search(
        rf"^## \[{re.escape(VERSION)}\]", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE
    )


def test_every_dependency_has_a_known_licence() -> None:
    told = licences.told()
    assert [name for name in licences.pinned() if name not in told] == [], "python3 tools/licences.py"
    assert [name for name, licence in told.items() if not licence] == []


def test_no_dependency_forbids_our_licence() -> None:
    strict = [name for name, licence in licences.told().items() if re.search(r"\b(AGPL|GPL)", licence)]
    assert set(strict) <= licences.TOOLS_UNDER_GPL
