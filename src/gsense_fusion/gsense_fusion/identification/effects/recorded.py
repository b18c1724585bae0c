"""Effects that the recording itself shows: its stamps, its values' lattice, its magnetometer.

Nothing is fitted to the gyro, and nothing can be subtracted from it: they say what to set or to mend.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from gsense_fusion.identification.campaign import Campaign
from gsense_fusion.identification.effects.base import Drivers, Effect
from gsense_fusion.identification.effects.design import Design
from gsense_fusion.identification.recording.clock import Skew
from gsense_fusion.identification.recording.curve import Curve
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import Parameter


@dataclass(frozen=True, eq=False)
class Recording:
    """What these effects look at."""

    clean: tuple[CleanRun, ...]
    """The bags, one run each."""
    campaign: Campaign
    skew: Skew | None
    """Of the IMU's clock against the encoder's; None where nothing tells."""
    names: frozenset[str] = frozenset()
    """Effects that the catalogue can name."""


@dataclass(frozen=True, eq=False)
class Reading:
    """An effect that the recording shows."""

    parameters: Mapping[str, Parameter]
    axes: tuple[str, ...]
    p_value: float
    symptom: str
    """What is there, in words: said where the catalogue has no name for it."""
    advice: str
    """What to set or to mend."""
    alternatives: tuple[str, ...] = ()
    separating_run: str | None = None
    curve: Curve | None = None


@dataclass(frozen=True, eq=False)
class Seen:
    """All that the recording shows."""

    readings: Mapping[str, Reading] = field(default_factory=dict)
    """By effect."""
    unnamed: tuple[Reading, ...] = ()
    """What no entry of the catalogue names."""
    notes: tuple[str, ...] = ()
    undecided: tuple[str, ...] = ()


class RecordedEffect(Effect):
    """An entry of the catalogue that is read from the recording."""

    parameters = ()
    dynamic = False

    @abstractmethod
    def look(self, recording: Recording) -> Seen:
        """What there is of this effect: a reading under its own name, or notes, or nothing."""

    def missing(self, drivers: Drivers) -> str | None:  # noqa: ARG002
        """What it needs is said by `look`."""
        return None

    def design(self, drivers: Drivers) -> Design:
        """No columns, shape (n, 3, 0)."""
        return np.zeros((len(drivers), 3, 0))


def look_at(recording: Recording, known: Sequence[RecordedEffect], named: frozenset[str]) -> Seen:
    """What all tests of the recording show; what is not among `named` has no name and stays unexplained."""
    readings: dict[str, Reading] = {}
    unnamed: list[Reading] = []
    notes: list[str] = []
    undecided: list[str] = []
    for effect in known:
        seen = effect.look(recording)
        notes += [n for n in seen.notes if n not in notes]
        undecided += [n for n in seen.undecided if n not in undecided]
        unnamed += [u for u in seen.unnamed if u not in unnamed]
        for name, reading in seen.readings.items():
            if name in named:
                readings[name] = reading
            else:
                unnamed.append(reading)
    return Seen(readings, tuple(unnamed), tuple(notes), tuple(undecided))
