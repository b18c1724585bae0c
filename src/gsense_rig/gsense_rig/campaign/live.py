"""A campaign on the live rig: a bag per run and `index.yaml`, the same as `simulate` writes, resumed where it stopped.

A run's bag is recorded in a hidden folder and takes its name when it is closed and found sound: a bag that is there is
done, and everything else is made (again).
"""

from __future__ import annotations

import fcntl
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from gsense_rig.campaign.carriage import STILL_AFTER, STILL_BEFORE
from gsense_rig.campaign.crew import CampaignError, Crew, RunOutcome, Show
from gsense_rig.campaign.index import DONE, INDEX, Index, checksum, is_intact, read_index
from gsense_rig.campaign.order import draw_order
from gsense_rig.campaign.plan import Plan, PlanRun
from gsense_rig.campaign.session import REMOUNT
from gsense_rig.recording.bag import storage_file
from gsense_rig.recording.metadata import METADATA

BYTES_PER_SECOND = 1.0e6
"""Twice what the contract's topics fill."""
SPACE_LEFT = 200e6
"""Bytes that stay free on the disk."""
AROUND = STILL_BEFORE + STILL_AFTER + 8.0
"""s a run takes beside its motion: rests, approach, ramps, start of the recorder."""
_WORK = ".unfinished"
_LOCK = ".lock"
_TRUTH = "truth.yaml"


@dataclass(frozen=True)
class Limits:
    """When a run does not count."""

    loss: float = 1e-3
    """Share of the link's frames."""
    attempts: int = 3
    """Of one run, before the campaign stops."""


@dataclass(frozen=True)
class Step:
    """Where the campaign is; for the progress display."""

    number: int
    total: int
    run: PlanRun
    what: str
    remaining: float
    """s that the runs still to be made will take."""


@dataclass(frozen=True)
class LiveResult:
    """What was done."""

    folder: Path
    made: int
    kept: int
    frames: int
    lost: int


FreeSpace = Callable[[Path], float]


def free_space(folder: Path) -> float:
    """Bytes free on the folder's disk."""
    return float(shutil.disk_usage(folder).free)


def seconds_of(run: PlanRun, former: str | None) -> float:
    """How long a run will take, s; `former` is how the board is mounted before it."""
    return run.duration + AROUND + (REMOUNT if former not in (None, run.mounting) else 0.0)


class LiveCampaign:
    """Makes the runs of a plan that a folder does not hold yet.

    Args:
        plan: what to make.
        folder: where bags and index go; made where it does not exist.
        crew: the rig and who turns the board.
        seed: draws the order of a new campaign; None keeps the plan's.
        limits: when a run does not count.
        progress: told of every step.
        space: bytes free; for tests.

    Raises (all methods):
        CampaignError: cannot begin or go on; what was made stays and is not made again.
    """

    def __init__(
        self,
        plan: Plan,
        folder: Path,
        crew: Crew,
        seed: int | None = 1,
        limits: Limits | None = None,
        progress: Callable[[Step], None] | None = None,
        space: FreeSpace = free_space,
    ) -> None:
        self._plan = plan
        self._folder = folder
        self._crew = crew
        self._seed = seed
        self._limits = limits or Limits()
        self._progress = progress
        self._space = space

    def run(self) -> LiveResult:
        """The whole campaign, or what is left of it."""
        with _locked(self._folder):
            index = self._adopt(self._open())
            todo = [k for k, entry in enumerate(index.runs) if entry.state != DONE]
            kept = len(index.runs) - len(todo)
            frames = lost = 0
            if todo:
                self._check_space(index, todo)
                self._check_link()
                self._crew.ready()
            mounting: str | None = None
            for place, number in enumerate(todo):
                self._check_space(index, todo[place:])
                tell = partial(self._tell, index, number, self._remaining(index, todo[place:], mounting))
                if index.runs[number].plan.mounting != mounting:
                    mounting = index.runs[number].plan.mounting
                    tell("turn the board")
                    self._crew.turn(mounting)
                outcome = self._make(index, number, tell)
                index = self._commit(index, number, outcome)
                frames, lost = frames + outcome.frames, lost + outcome.lost
            shutil.rmtree(self._folder / _WORK, ignore_errors=True)
            return LiveResult(self._folder, len(todo), kept, frames, lost)

    def _open(self) -> Index:
        """The folder's index; a new one where it is empty."""
        folder = self._folder
        unit = self._crew.unit_id()
        if not (folder / INDEX).is_file():
            if any(entry.name not in (_LOCK, f"{INDEX}.tmp") for entry in folder.iterdir()):
                raise CampaignError(f"{folder}: is not empty and holds no campaign; give another folder")
            runs = self._plan.runs if self._seed is None else draw_order(self._plan.runs, self._seed)
            index = Index.of_plan(Plan(self._plan.name, tuple(runs)), unit)
            index.write(folder)
            return index
        if (folder / _TRUTH).is_file():
            raise CampaignError(f"{folder}: holds a simulated campaign; give another folder")
        index = read_index(folder)
        if Counter(entry.plan for entry in index.runs) != Counter(self._plan.runs):
            raise CampaignError(f"{folder}: holds a campaign of another plan; give another folder")
        if index.unit_id != unit:
            raise CampaignError(
                f"{folder}: holds a campaign of unit {index.unit_id!r}, but {unit!r} is on the rail; "
                "give another folder"
            )
        return index

    def _adopt(self, index: Index) -> Index:
        """The index as the folder is: a bag that got its name counts, one that is damaged does not."""
        for number, entry in enumerate(index.runs):
            bag = self._folder / entry.bag
            if entry.state == DONE and not is_intact(self._folder, entry):
                index = index.with_pending(number)
            elif entry.state != DONE and (bag / METADATA).is_file() and storage_file(bag).is_file():
                index = index.with_done(number, checksum(storage_file(bag)))
            else:
                continue
            index.write(self._folder)
        return index

    def _make(self, index: Index, number: int, show: Show) -> RunOutcome:
        """One run, again where link, board or recorder lost too much; its bag is in the hidden folder."""
        entry, problem = index.runs[number], ""
        for _ in range(self._limits.attempts):
            bag = self._work(entry.bag)
            outcome = self._crew.make_run(entry.plan, bag, show)
            if outcome.loss > self._limits.loss:
                problem = f"the link lost {outcome.lost} of {outcome.frames + outcome.lost} frames"
            elif outcome.interrupted:
                problem = outcome.interrupted
            elif outcome.unkept:
                problem = f"the recorder could not keep {outcome.unkept} messages"
            else:
                return outcome
            show(f"again: {problem}")
        shutil.rmtree(bag, ignore_errors=True)
        raise CampaignError(f"{entry.bag}: {problem}, in each of {self._limits.attempts} attempts; mend that and go on")

    def _work(self, bag: str) -> Path:
        """An empty place for a bag."""
        path = self._folder / _WORK / bag
        shutil.rmtree(path, ignore_errors=True)
        path.parent.mkdir(exist_ok=True)
        return path

    def _commit(self, index: Index, number: int, outcome: RunOutcome) -> Index:
        """The bag takes its name, then the index says so; a crash in between is mended by `_adopt`."""
        name = index.runs[number].bag
        shutil.rmtree(self._folder / name, ignore_errors=True)
        (self._folder / _WORK / name).rename(self._folder / name)
        file = storage_file(self._folder / name)
        index = index.with_done(number, checksum(file), outcome.lost, outcome.rms_error)
        index.write(self._folder)
        return index

    def _check_space(self, index: Index, todo: list[int]) -> None:
        needed = BYTES_PER_SECOND * sum(index.runs[k].plan.duration + AROUND for k in todo) + SPACE_LEFT
        free = self._space(self._folder)
        if free < needed:
            raise CampaignError(
                f"{self._folder}: {free / 1e6:.0f} MB free, {len(todo)} runs need {needed / 1e6:.0f} MB; make room"
            )

    def _check_link(self) -> None:
        figures = self._crew.link_figures()
        if not figures.frames:
            raise CampaignError(f"no frame came over the link in {figures.seconds:.0f} s; switch the board on")
        if figures.loss > self._limits.loss:
            raise CampaignError(
                f"the link lost {figures.lost} of {figures.frames + figures.lost} frames in {figures.seconds:.0f} s; "
                "mend it first (antenna, distance, board's supply)"
            )

    def _remaining(self, index: Index, todo: list[int], mounting: str | None) -> float:
        seconds = 0.0
        for number in todo:
            run = index.runs[number].plan
            seconds += seconds_of(run, mounting)
            mounting = run.mounting
        return seconds

    def _tell(self, index: Index, number: int, remaining: float, what: str) -> None:
        if self._progress is not None:
            self._progress(Step(number, len(index.runs), index.runs[number].plan, what, remaining))


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """One campaign at a time in a folder; the lock goes with the process."""
    if folder.exists() and not folder.is_dir():
        raise CampaignError(f"{folder}: is a file; give a folder")
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / _LOCK).open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise CampaignError(f"{folder}: another campaign is running there") from None
        try:
            yield
        finally:
            (folder / _LOCK).unlink(missing_ok=True)
