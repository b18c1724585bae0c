"""Links of the documents lead somewhere, files that they name exist, and so do the folders of the architecture."""

from __future__ import annotations

import re
import subprocess
from functools import cache
from pathlib import Path

import pytest
from tests.docs.documents import DOCUMENTS, ROOT

from gsense_rig.demonstration.folder import DemoFolder

BY_NAME = pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())


@cache
def tracked() -> tuple[str, ...]:
    listed = subprocess.run(
        ["git", "ls-files", "-co", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    if listed.returncode == 0:
        return tuple(listed.stdout.splitlines())
    return tuple(file.relative_to(ROOT).as_posix() for file in ROOT.rglob("*") if file.is_file())


@cache
def anchors(file: Path) -> frozenset[str]:
    """Headings as GitHub makes anchors of them."""
    headings = re.findall(r"^#+ (.*)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    return frozenset(re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings)


@BY_NAME
def test_every_link_leads_somewhere(document: Path) -> None:
    wrong = []
    for target in re.findall(r"\]\(([^)\s]+)\)", document.read_text(encoding="utf-8")):
        if re.match(r"https?:", target):
            continue
        place, _, anchor = target.partition("#")
        file = (document.parent / place).resolve() if place else document
        if not file.exists() or (anchor and anchor not in anchors(file)):
            wrong.append(target)
    assert wrong == []


@BY_NAME
def test_every_source_that_is_named_exists(document: Path) -> None:
    text = document.read_text(encoding="utf-8")
    named = re.findall(r"`([\w/.-]+\.(?:py|c|h|asm|xml|rules|service|urdf|mcap|j2))(?:::?\w+)?`", text)
    wrong = {name for name in named if not any(file == name or file.endswith(f"/{name}") for file in tracked())}
    made = {name for name in wrong if re.match(r"(my_effects|run_\w+)\.", name)}
    assert wrong - made == set()


@BY_NAME
def test_every_file_of_a_demo_that_is_named_is_one_that_it_writes(document: Path) -> None:
    demo = DemoFolder(Path("out/demo"))
    report = {demo.report / name for name in ("report.html", "report.json", "compensation.yaml", "next_plan.yaml")}
    written = {demo.live_bag, demo.campaign, demo.hidden, demo.summary, *report}
    assert {Path(name) for name in re.findall(r"out/demo/[\w/.]*\w", document.read_text(encoding="utf-8"))} <= written


def test_every_folder_of_the_architecture_exists() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    block = re.findall(r"```\n(rig +entry script.*?)```", text, re.DOTALL)[0]
    folders = {file.rsplit("/", 1)[0] for file in tracked() if "/" in file}
    paths = {
        "/".join(parts[:n]) for folder in folders for parts in [folder.split("/")] for n in range(1, len(parts) + 1)
    }
    named = re.findall(r"(?<![\w./])([\w/.]+)/(?=[\s,({;)]|$)", block)
    assert len(named) > 30
    missing = [name for name in named if not any(path == name or path.endswith(f"/{name}") for path in paths)]
    assert missing == []


def test_every_page_is_in_the_index() -> None:
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    pages = [file.name for file in (ROOT / "docs").glob("*.md") if file.name != "README.md"]
    assert [page for page in pages if f"({page})" not in index and f"({page}#" not in index] == []
