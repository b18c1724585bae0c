"""What a live campaign needs of the rig, the board and whoever turns it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from gsense_rig.campaign.plan import PlanRun


class CampaignError(RuntimeError):
    """The campaign cannot begin or go on; the message is one line that says what to do."""


@dataclass(frozen=True)
class RunOutcome:
    """What one run brought."""

    messages: int
    frames: int
    """Frames that the link received meanwhile."""
    lost: int
    """Frames that the link lost meanwhile."""
    unkept: int
    """Messages that the recorder could not keep."""
    rms_error: float | None
    """Tracking error of the motion, m; None for a rest."""
    interrupted: str = ""
    """Why the samples are not of one piece, where no count of lost frames says so; empty: they are."""

    @property
    def loss(self) -> float:
        """Share of the frames that were lost."""
        return self.lost / max(1, self.lost + self.frames)


@dataclass(frozen=True)
class LinkFigures:
    """The link over a few seconds."""

    frames: int
    lost: int
    seconds: float

    @property
    def loss(self) -> float:
        """Share of the frames that were lost."""
        return self.lost / max(1, self.lost + self.frames)


Show = Callable[[str], None]
"""Told what is going on, for the progress display."""


class Crew(Protocol):
    """The live rig; every method raises CampaignError where it cannot."""

    def unit_id(self) -> str:
        """Which unit sits on the carriage, as the link says."""

    def link_figures(self) -> LinkFigures:
        """Watches the link for a few seconds."""

    def ready(self) -> None:
        """Homes the rig where that is due."""

    def turn(self, mounting: str) -> None:
        """Sees to it that the board is mounted so."""

    def make_run(self, run: PlanRun, bag: Path, show: Show) -> RunOutcome:
        """Makes one run and leaves its closed bag."""


class Operator(Protocol):
    """Who turns the board."""

    at_hand: bool
    """Whether it is a person, for whom the carriage is parked."""

    def turn(self, mounting: str) -> None:
        """Returns when the board is mounted so; raises CampaignError."""

    def confirm(self, question: str) -> None:
        """Returns when it may begin; raises CampaignError."""
