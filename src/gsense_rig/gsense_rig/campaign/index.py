"""`index.yaml` of a campaign: each run's bag, plan entry, role, checksum and state. Seed and effects are not in it."""

from __future__ import annotations

import hashlib
import reprlib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from gsense_driver.user_input.yaml_text import parse_yaml
from gsense_rig.campaign.plan import Plan, PlanRun
from gsense_rig.recording.bag import storage_file

SCHEMA = "gsense-index/1"
INDEX = "index.yaml"
PENDING, DONE = "pending", "done"


class CampaignIndexError(ValueError):
    """An index that cannot be used; the message is one line."""


@dataclass(frozen=True)
class IndexEntry:
    """One run."""

    bag: str
    plan: PlanRun
    checksum: str | None = None
    """`sha256:...` of the bag's storage file."""
    state: str = PENDING
    lost: int | None = None
    """Frames that the link lost during the run; None where it was simulated."""
    rms_error: float | None = None
    """Tracking error of a live motion, m."""

    def to_dict(self) -> dict[str, Any]:
        """Plain types, as in the file."""
        live = {"lost": self.lost, "rms_error": self.rms_error} if self.lost is not None else {}
        return {
            "bag": self.bag,
            "role": self.plan.role,
            "state": self.state,
            "checksum": self.checksum,
            **live,
            "plan": self.plan.to_dict(),
        }


@dataclass(frozen=True)
class Index:
    """All runs of a campaign, in order."""

    plan: str
    unit_id: str
    runs: tuple[IndexEntry, ...]

    @classmethod
    def of_plan(cls, plan: Plan, unit_id: str) -> Index:
        """Nothing done yet."""
        return cls(plan.name, unit_id, tuple(IndexEntry(f"run_{i:02d}", run) for i, run in enumerate(plan.runs)))

    def with_done(self, number: int, checksum: str, lost: int | None = None, rms_error: float | None = None) -> Index:
        """The same with one more run done."""
        return self._with(number, checksum=checksum, state=DONE, lost=lost, rms_error=rms_error)

    def with_pending(self, number: int) -> Index:
        """The same with a run to be made again."""
        return self._with(number, checksum=None, state=PENDING, lost=None, rms_error=None)

    def _with(self, number: int, **changes: Any) -> Index:
        runs = list(self.runs)
        runs[number] = replace(runs[number], **changes)
        return replace(self, runs=tuple(runs))

    def same_plan(self, other: Index) -> bool:
        """Whether both have the same runs to make of the same unit."""
        return self.unit_id == other.unit_id and [e.plan for e in self.runs] == [e.plan for e in other.runs]

    def to_dict(self) -> dict[str, Any]:
        """Plain types, as in the file."""
        runs = [entry.to_dict() for entry in self.runs]
        return {"schema": SCHEMA, "plan": self.plan, "unit_id": self.unit_id, "runs": runs}

    def write(self, folder: Path) -> None:
        """Writes `folder/index.yaml` whole or not at all."""
        write_yaml(folder / INDEX, self.to_dict())


def read_index(folder: Path) -> Index:
    """Reads `folder/index.yaml`; raises CampaignIndexError."""
    path = folder / INDEX
    try:
        data = parse_yaml(path.read_text(encoding="utf-8"))
        _check_schema(data["schema"])
        return Index(str(data["plan"]), str(data["unit_id"]), tuple(_entry(e) for e in data["runs"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        text = f"{type(error).__name__}: {' '.join(str(error).split())}"
        raise CampaignIndexError(f"{path}: is not an index of a campaign ({text})") from error


def _check_schema(schema: Any) -> None:
    if schema != SCHEMA:
        raise ValueError(f"schema {reprlib.repr(schema)} is not {SCHEMA}")


def _entry(e: dict[str, Any]) -> IndexEntry:
    """One run; raises what its kind of mistake raises, among them ValueError for a bag outside of the folder."""
    bag, plan = e["bag"], e["plan"]
    if not isinstance(bag, str) or Path(bag).name != bag or not isinstance(plan, dict):
        raise ValueError(f"bag {reprlib.repr(bag)}: the name of a folder beside the index, with its plan, is needed")
    return IndexEntry(bag, PlanRun(**plan), e["checksum"], e["state"], e.get("lost"), e.get("rms_error"))


def is_intact(folder: Path, entry: IndexEntry) -> bool:
    """Whether a run is done and its bag is still what was written."""
    file = storage_file(folder / entry.bag)
    return entry.state == DONE and file.is_file() and checksum(file) == entry.checksum


def checksum(file: Path) -> str:
    """`sha256:` and hex digits."""
    digest = hashlib.sha256()
    with file.open("rb") as stream:
        for block in iter(lambda: stream.read(1 << 20), b""):
            digest.update(block)
    return f"sha256:{digest.hexdigest()}"


def write_yaml(path: Path, data: dict[str, Any]) -> None:
    """Writes under a temporary name and renames."""
    temporary = path.with_name(path.name + ".tmp")
    try:
        temporary.write_text(yaml.safe_dump(data, sort_keys=False, width=160), encoding="utf-8")
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
