"""What a comparison of two reports consists of."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import inf, sqrt

from gsense_fusion.identification.types import Parameter

from .snapshot import Snapshot

FALSE_ALARM = 0.01
"""Chance that two analyses of the same thing are said to differ, all tests together."""


class Status(str, Enum):
    """What became of an effect."""

    SAME = "same"
    DRIFTED = "drifted"
    ENTERED = "entered"
    GONE = "gone"
    SETTLED = "settled"
    """The one could not tell it from its rivals, the other can, or names another of them."""
    UNSURE = "unsure"
    """Only one names it, and the other does not exclude it."""
    SESSION = "of the session"
    """The bias: it differs from one switching on to the next."""


CHANGES = frozenset({Status.DRIFTED, Status.ENTERED, Status.GONE})


@dataclass(frozen=True)
class Difference:
    """A parameter in both reports; its values are kept where only one has it."""

    name: str
    unit: str
    old: Parameter | None
    new: Parameter | None
    known_stderr: float | None = None
    """Of the difference if nothing changed, by the covariances."""
    identified: bool = True
    """Whether both reports' data identify it."""

    @property
    def value(self) -> float:
        """New less old; NaN where only one has it."""
        return self.new.value - self.old.value if self.old and self.new else float("nan")

    @property
    def stderr(self) -> float:
        """Of the difference."""
        if self.known_stderr is not None:
            return self.known_stderr
        return sqrt(self.old.stderr**2 + self.new.stderr**2) if self.old and self.new else inf

    @property
    def z(self) -> float:
        """Difference in standard errors; NaN where that means nothing."""
        return self.value / self.stderr if self.identified and 0.0 < self.stderr < inf else float("nan")


@dataclass(frozen=True)
class EffectChange:
    """An effect that at least one of the two needs."""

    effect: str
    owner: str | None
    status: Status
    parameters: tuple[Difference, ...]
    chi2: float | None
    dof: int
    p_value: float | None
    note: str = ""


@dataclass(frozen=True)
class ScalarChange:
    """One number in both reports."""

    name: str
    unit: str
    old: Parameter
    new: Parameter
    p_value: float | None
    """None: said, not tested."""
    relevant: bool = True
    """Whether the difference is large enough to speak of."""
    known_stderr: float | None = None
    """Of the difference, where it is not that of independent errors."""

    @property
    def difference(self) -> Parameter:
        """New less old."""
        independent = sqrt(self.old.stderr**2 + self.new.stderr**2)
        stderr = independent if self.known_stderr is None else self.known_stderr
        return Parameter(self.new.value - self.old.value, stderr, self.unit)


@dataclass(frozen=True)
class Comparison:
    """What changed."""

    old: Snapshot
    new: Snapshot
    effects: tuple[EffectChange, ...]
    k: ScalarChange | None
    scalars: tuple[ScalarChange, ...]
    """Noise by axis, delay, error and floor."""
    unexplained: Status | None
    warnings: tuple[str, ...]
    level: float
    """Chance of a false alarm that each test has."""

    @property
    def two_units(self) -> bool:
        """Whether the reports are of two units: what differs has not changed in time."""
        return bool(self.old.unit_id and self.new.unit_id and self.old.unit_id != self.new.unit_id)

    @property
    def changed_effects(self) -> tuple[EffectChange, ...]:
        """Those that drifted, entered or are gone."""
        return tuple(e for e in self.effects if e.status in CHANGES)

    @property
    def changed_scalars(self) -> tuple[ScalarChange, ...]:
        """Noise and delay that differ."""
        return tuple(s for s in self.scalars if s.p_value is not None and s.p_value < self.level and s.relevant)

    @property
    def verdict(self) -> str:
        """Whether anything did: changed or nothing_changed."""
        changed = self.changed_effects or self.changed_scalars or self.unexplained in CHANGES
        return "changed" if changed else "nothing_changed"
