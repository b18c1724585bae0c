"""What all sessions say together: k and effects of each unit over time, and whether k stayed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.stats import chi2

from gsense_fusion.comparison.contrast import IDENTIFIED_VARIANCE
from gsense_fusion.comparison.effect_changes import CYCLIC
from gsense_fusion.comparison.snapshot import Estimate, Presence, Snapshot
from gsense_fusion.identification.types import Parameter

from .work import State

UNNAMED = "not named"
FALSE_ALARM = 0.01
"""Chance that a k is said to move though none did, all units together."""


@dataclass(frozen=True)
class Scalar:
    """The thesis's k of one session: the weighted mean of those of its elements that the data identifies."""

    value: Parameter
    elements: tuple[str, ...]


@dataclass(frozen=True)
class Row:
    """One session on the page."""

    name: str
    state: State
    reason: str = ""
    report: Snapshot | None = None
    start_ns: int | None = None
    seconds: float = 0.0

    @cached_property
    def k(self) -> Scalar | None:
        """None where the data identifies no element."""
        return None if self.report is None else scalar_k(self.report.effects.get("g_sensitivity"))

    @property
    def found(self) -> list[Estimate]:
        """The effects that the report names."""
        effects = () if self.report is None else self.report.effects.values()
        return [e for e in effects if e.presence is Presence.FOUND]


@dataclass(frozen=True)
class Constancy:
    """Is k the same in all sessions of a unit?"""

    mean: Parameter
    chi2: float
    dof: int
    p_value: float


@dataclass(frozen=True)
class Unit:
    """One sensor of one unit, its sessions in order of time."""

    sensor: str
    unit_id: str
    rows: tuple[Row, ...]
    constancy: Constancy | None
    """Of the sessions whose k stands for the same elements; None where fewer than two do."""

    @property
    def effects(self) -> Counter[str]:
        """How often each effect was found."""
        return Counter(e.effect for row in self.rows for e in row.found)


@dataclass(frozen=True)
class Overview:
    """Everything on the summary page."""

    rows: tuple[Row, ...]
    """In the manifest's order."""
    units: tuple[Unit, ...]

    @property
    def verdicts(self) -> Mapping[str, int]:
        """How many sessions came to each verdict."""
        return Counter(row.report.verdict for row in self.rows if row.report is not None)

    @property
    def states(self) -> Mapping[str, int]:
        """How many sessions are in each state."""
        return Counter(row.state.value for row in self.rows)

    @property
    def level(self) -> float:
        """Chance of a false alarm that the test of each unit has."""
        return FALSE_ALARM / max(sum(u.constancy is not None for u in self.units), 1)


def overview(rows: Sequence[Row]) -> Overview:
    """Group the sessions by sensor and unit, and test whether k stayed."""
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if row.report is not None:
            groups.setdefault((row.report.sensor, row.report.unit_id or UNNAMED), []).append(row)
    units = []
    for (sensor, unit_id), members in sorted(groups.items()):
        ordered = sorted(members, key=lambda r: (r.start_ns is None, r.start_ns or 0, r.name))
        units.append(Unit(sensor, unit_id, tuple(ordered), _constancy(ordered)))
    return Overview(tuple(rows), tuple(units))


def scalar_k(g: Estimate | None) -> Scalar | None:
    """K of equation 7.4 from an estimate of G: the elements that the data identifies, weighted by their errors."""
    if g is None:
        return None
    known = []
    for name in CYCLIC:
        p = g.parameters.get(name)
        if p is not None and p.stderr > 0.0 and _identified(g, name):
            known.append((name, p))
    if not known:
        return None
    weights = np.array([p.stderr**-2 for _, p in known])
    value = float(weights @ np.array([p.value for _, p in known]) / weights.sum())
    stderr = float(weights.sum() ** -0.5)
    return Scalar(Parameter(value, stderr, known[0][1].unit), tuple(name for name, _ in known))


def _identified(g: Estimate, name: str) -> bool:
    c = g.covariance
    if c is None or name not in c.parameters:
        return True
    i = c.parameters.index(name)
    return bool(c.matrix[i, i] < IDENTIFIED_VARIANCE * c.plausible[i] ** 2)


def _constancy(rows: Sequence[Row]) -> Constancy | None:
    """Chi-square of the k's that stand for the elements that most sessions identify."""
    known = [row.k for row in rows if row.k is not None]
    if not known:
        return None
    elements = Counter(k.elements for k in known).most_common(1)[0][0]
    same = [k.value for k in known if k.elements == elements]
    if len(same) < 2:
        return None
    value, stderr = (np.array([getattr(p, what) for p in same]) for what in ("value", "stderr"))
    weights = stderr**-2
    mean = float(weights @ value / weights.sum())
    statistic, dof = float(np.sum(((value - mean) / stderr) ** 2)), len(same) - 1
    parameter = Parameter(mean, float(weights.sum() ** -0.5), same[0].unit)
    return Constancy(parameter, statistic, dof, float(chi2.sf(statistic, dof)))
