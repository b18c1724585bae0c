"""From the manifest's patterns to sessions: which bags there are, and what each session is called."""

from __future__ import annotations

import glob
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from gsense_fusion.campaigns import INDEX, campaign_bags
from gsense_fusion.cli import roles
from gsense_fusion.closing import Request
from gsense_fusion.identification.types import IdentificationError, Role

from .manifest import Choices, ManifestEntry, ManifestError

LONGEST_NAME = 120


@dataclass(frozen=True)
class Session:
    """One session to analyse."""

    name: str
    """Of its folder and on the page."""
    request: Request
    unit_id: str | None = None
    problem: str | None = None
    """Why it cannot even be tried; one line."""
    size: int = 0
    """Bytes of its bags: what its time is estimated by."""


@dataclass(frozen=True)
class _Found:
    """A session without its name."""

    session: Session
    home: Path
    named: bool
    place: str


def find_sessions(entries: Sequence[ManifestEntry], folder: Path) -> list[Session]:
    """All sessions of a manifest in its order; what is wrong with one is its own `problem`.

    Args:
        entries: The manifest's.
        folder: Where relative paths start.

    Raises:
        ManifestError: two sessions would have the same name.
    """
    found = [f for entry in entries for f in _expand(entry, folder)]
    return _named(found)


def _expand(entry: ManifestEntry, folder: Path) -> list[_Found]:
    if entry.campaign is None:
        return [_of_bags(entry, folder)]
    homes = [p.parent if p.name == INDEX else p for p in _matches(entry.campaign, folder)]
    homes = [p for p in dict.fromkeys(homes) if p.is_dir() or not _is_pattern(entry.campaign)]
    if entry.name is not None and len(homes) > 1:
        raise ManifestError(f"{entry.place}.name: {entry.campaign} matches {len(homes)} campaigns; leave the name out")
    if not homes:
        return [_found(entry, folder / entry.campaign, [], f"{entry.campaign}: no campaign matches")]
    return [_of_campaign(entry, home) for home in homes]


def _of_campaign(entry: ManifestEntry, home: Path) -> _Found:
    problem: str | None = None
    bags: list[tuple[Path, Role]] = []
    try:
        bags = campaign_bags(home)
    except (IdentificationError, OSError) as error:
        problem = str(error)
    return _found(entry, home, bags, problem)


def _of_bags(entry: ManifestEntry, folder: Path) -> _Found:
    problem: str | None = None
    bags: list[tuple[Path, Role]] = []
    try:
        fit, held_out = (_bags(patterns, folder) for patterns in (entry.fit, entry.held_out))
        bags = roles([p for p in fit if p not in held_out or not _any_pattern(entry.fit)], held_out)
        home = bags[0][0].parent if bags else folder
    except IdentificationError as error:
        problem, home = str(error), folder / entry.fit[0]
    return _found(entry, home, bags, problem)


def _found(entry: ManifestEntry, home: Path, bags: list[tuple[Path, Role]], problem: str | None) -> _Found:
    size = sum(_size(path) for path, _ in bags)
    session = Session(entry.name or "", _request(tuple(bags), entry.choices), entry.unit_id, problem, size)
    return _Found(session, home.absolute(), entry.name is not None, entry.place)


def _request(bags: tuple[tuple[Path, Role], ...], c: Choices) -> Request:
    effects = None if c.effects is None else c.effects.absolute()
    return Request(bags, c.sensor, c.declared, effects, c.latitude, c.rail_azimuth)


def _bags(patterns: Sequence[str], folder: Path) -> list[Path]:
    """Bags that the patterns match, each once; raises IdentificationError where one matches none."""
    out: list[Path] = []
    for pattern in patterns:
        matches = _matches(pattern, folder)
        if not matches:
            raise IdentificationError(f"{pattern}: no bag matches")
        out += matches
    return list(dict.fromkeys(out)) if _any_pattern(patterns) else out


def _matches(pattern: str, folder: Path) -> list[Path]:
    """Absolute paths in order; a path without wildcards is itself, there or not."""
    if not _is_pattern(pattern):
        return [(folder / pattern).absolute()]
    # pathlib's own refuses absolute patterns
    return [(folder / p).absolute() for p in sorted(glob.glob(pattern, root_dir=folder, recursive=True))]  # noqa: PTH207


def _is_pattern(text: str) -> bool:
    return glob.has_magic(text)


def _any_pattern(patterns: Sequence[str]) -> bool:
    return any(map(_is_pattern, patterns))


def _size(path: Path) -> int:
    try:
        files = [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]
        return sum(p.stat().st_size for p in files)
    except OSError:
        return 0


def _named(found: Sequence[_Found]) -> list[Session]:
    """Sessions with names of their own: the folder's; a later one of the same name says more of itself.

    The first keeps the short name, so that what is added to a manifest does not rename what was there.
    """
    taken = {f.session.name: f.place for f in reversed(found) if f.named}
    out = []
    for f in found:
        name = f.session.name
        if f.named:
            if _clean(name) != name:
                raise ManifestError(f"{f.place}.name: {name!r} is no name of a folder; use letters, digits, . _ + -")
            if taken[name] != f.place:
                raise ManifestError(f"{taken[name]} and {f.place} are both named {name!r}; one needs another name")
        else:
            free = [n for n in _candidates(f) if n not in taken]
            if not free:
                raise ManifestError(f"{f.place}: the same as another entry, {f.home}; give it a `name:`")
            name = free[0]
            taken[name] = f.place
        out.append(replace(f.session, name=name))
    return out


def _candidates(f: _Found) -> list[str]:
    """From short to long: the folder, the sensor, the folders above."""
    return [_candidate(f, depth, sensor=sensor) for depth in (1, 2, 3, 4) for sensor in (False, True)]


def _candidate(f: _Found, depth: int, *, sensor: bool) -> str:
    parts = [*f.home.parts[-depth:], *([f.session.request.sensor.strip("/")] if sensor else [])]
    return _clean("-".join(p for p in parts if p != "/"))


def _clean(name: str) -> str:
    """A name that is safe as a folder's, and never hidden."""
    return re.sub(r"[^\w.+-]+", "_", name)[-LONGEST_NAME:].lstrip(".") or "session"
