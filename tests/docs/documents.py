"""The commands that stand in the documents: in fenced blocks line by line, in the text between backticks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("firmware/*.md")])
_PROGRAMS = "ros2 sudo pip pip-audit cmake ctest source colcon firmware/pic/build firmware/build/\\S+ ls python3?"
_BEGIN = rf"(?:\./rig|{_PROGRAMS.replace(' ', '|')})(?![\w-])"
_SPAN = re.compile(rf"`({_BEGIN} [^`]+)`")
# output, code and data
_NO_COMMANDS = ("text", "python", "yaml", "json", "xml", "c")


class Command(NamedTuple):
    """One command, as it is written."""

    document: Path
    line: int
    text: str

    def __str__(self) -> str:
        return f"{self.document.relative_to(ROOT)}:{self.line}: {self.text}"


class Block(NamedTuple):
    """A fenced block."""

    line: int
    language: str
    text: str


def blocks(document: Path) -> Iterator[Block]:
    """Every fenced block, or one indented by four blanks, of a document."""
    lines = document.read_text(encoding="utf-8").splitlines()
    begin = language = None
    for number, line in enumerate(lines, 1):
        if line.startswith("```"):
            if begin is None:
                begin, language = number, line[3:].strip()
            else:
                yield Block(begin + 1, language or "", "\n".join(lines[begin : number - 1]))
                begin = None
        elif begin is None and re.match(rf" {{4}}{_BEGIN}", line):
            yield Block(number, "", line[4:])


def commands(document: Path) -> Iterator[Command]:
    """Every command of a document; `a && b` are two."""
    fenced: set[int] = set()
    for block in blocks(document):
        for offset, line in enumerate(block.text.splitlines()):
            fenced.add(block.line + offset)
            if block.language not in _NO_COMMANDS and re.match(_BEGIN, line.strip()) and "   core/" not in line:
                yield from _parts(document, block.line + offset, line.strip())
    for number, line in enumerate(document.read_text(encoding="utf-8").splitlines(), 1):
        if number not in fenced:
            for span in _SPAN.findall(line):
                yield from _parts(document, number, span)


def _parts(document: Path, line: int, text: str) -> Iterator[Command]:
    text = re.sub(r"\s#.*", "", text)
    for part in re.split(r" (?:&&|\|) ", text):
        yield Command(document, line, part.strip())
