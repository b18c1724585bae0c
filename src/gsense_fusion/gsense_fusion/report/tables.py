"""Rows of the report's tables: every number already in words, so that the template only places them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import PurePath

from gsense_fusion.identification.errors.metrics import Rms
from gsense_fusion.identification.result import Finding, LoopResult, RunSummary
from gsense_fusion.identification.types import AXES, Parameter
from gsense_fusion.report.units import DEG, engineers, interval, number, probability, together
from gsense_fusion.report.words import OWNER_NAMES, correction, separating_run

MATRIX_NAME = re.compile(r"^[a-z]_([xyz])([xyz])$")
UNIDENTIFIED = 10.0
"""An interval this many times wider than those of the significant entries: the data does not identify the entry."""


@dataclass(frozen=True)
class Bar:
    """One bar of a small bar chart in HTML."""

    key: str
    label: str
    value: str
    percent: float


@dataclass(frozen=True)
class BarChart:
    """Bars with one unit, and where the noise floor stands."""

    title: str
    unit: str
    si: str
    bars: tuple[Bar, ...]
    floor_percent: float | None


@dataclass(frozen=True)
class ParameterRow:
    """One parameter in both units."""

    name: str
    value: str
    si: str
    significant: bool


@dataclass(frozen=True)
class Cell:
    """One entry of a matrix of parameters."""

    value: str
    si: str
    significant: bool
    identified: bool


@dataclass(frozen=True)
class ParameterTable:
    """All parameters of an effect: a matrix (rows gyro axes, columns accelerometer axes) or a list."""

    effect: str
    rows: tuple[ParameterRow, ...]
    matrix: tuple[tuple[str, tuple[Cell, ...]], ...]
    unit: str
    si_unit: str


@dataclass(frozen=True)
class FindingCard:
    """A finding in words."""

    effect: str
    owner: str
    correction: str
    equation: str
    source: str
    axes: str
    parameters: ParameterTable
    probability: str
    before: str
    after: str
    subtracts: bool
    """Whether correcting it changes the rate."""
    alternatives: tuple[str, ...]
    separating_run: str | None


@dataclass(frozen=True)
class RunRow:
    """One bag."""

    number: int
    bag: str
    path: str
    role: str
    drive: str
    amplitude: str
    samples: str
    lost: str
    rate: str
    session: int
    delay: str


@dataclass(frozen=True)
class RankedRow:
    """One model that was tried."""

    effects: str
    bic: str
    loglik: str
    best: bool
    chosen: bool


def bars(rms: Rms, title: str, *, found: bool, angle: bool = False) -> BarChart:
    """Raw, declared, full (where there are findings) and noise floor as bars of one chart."""
    named = [("raw", "bias alone", rms.raw), ("declared", "declared model", rms.declared)]
    if found:
        named.append(("full", "with the findings", rms.full))
    if rms.noise_floor is not None:
        named.append(("noise", "noise floor", rms.noise_floor))
    largest = max((v for _, _, v in named if isfinite(v)), default=0.0) or 1.0
    texts = together(*(v * DEG for _, _, v in named))
    shown = tuple(
        Bar(key, label, text, _percent(value, largest)) for (key, label, value), text in zip(named, texts, strict=True)
    )
    floor = None if rms.noise_floor is None else _percent(rms.noise_floor, largest)
    si = ", ".join(number(v) for _, _, v in named) + (" rad" if angle else " rad/s")
    return BarChart(title, "deg" if angle else "deg/s", si, shown, floor)


def _percent(value: float, largest: float) -> float:
    return round(100.0 * min(max(value / largest, 0.0), 1.0), 2) if isfinite(value) else 0.0


def pretty(text: str) -> str:
    """The ASCII of units and intervals as a page writes it."""
    signs = (
        ("+-", "±"),
        ("^2", "²"),
        ("^3", "³"),
        ("sqrt(Hz)", "√Hz"),
        ("sqrt(s)", "√s"),
        ("p < 1e-12", "p\u00a0<\u00a010⁻¹²"),
    )
    for plain, sign in signs:
        text = text.replace(plain, sign)
    return re.sub(r"(?<![\w.])-(?=\d)", "\N{MINUS SIGN}", text)


def parameter_table(effect: str, parameters: Mapping[str, Parameter]) -> ParameterTable:
    """A matrix where the names are those of one (g_xx ... g_zz), else a row each."""
    if len(parameters) == 9 and all(MATRIX_NAME.match(name) for name in parameters):
        by_entry = {name[-2:]: p for name, p in parameters.items()}
        widest = max((p.stderr for p in parameters.values() if p.significant), default=inf)
        unit = next(iter(parameters.values())).unit
        matrix = tuple((r, tuple(_cell(by_entry[r + c], widest) for c in AXES)) for r in AXES)
        return ParameterTable(effect, (), matrix, pretty(engineers(unit).unit), pretty(unit))
    rows = tuple(
        ParameterRow(
            name, pretty(interval(p, name)), pretty(interval(p, name, si=True)), p.significant and p.stderr > 0
        )
        for name, p in parameters.items()
    )
    return ParameterTable(effect, rows, (), "", "")


def _cell(p: Parameter, widest: float) -> Cell:
    unit = engineers(p.unit).unit
    value = interval(p).removesuffix(unit).strip()
    identified = p.significant or p.stderr <= UNIDENTIFIED * widest
    return Cell(pretty(value), pretty(interval(p, si=True)), p.significant, identified)


def finding_card(finding: Finding) -> FindingCard:
    """A finding as the page shows it."""
    before, after = together(finding.rate_rms_before * DEG, finding.rate_rms_after * DEG)
    return FindingCard(
        effect=finding.effect,
        owner=OWNER_NAMES[finding.owner],
        correction=correction(finding),
        equation=pretty(finding.equation),
        source=finding.source,
        axes=", ".join(finding.axes),
        parameters=parameter_table(finding.effect, finding.parameters),
        probability=pretty(probability(finding.p_value)),
        before=f"{before} deg/s",
        after=f"{after} deg/s",
        subtracts=finding.rate_rms_after != finding.rate_rms_before,
        alternatives=finding.alternatives,
        separating_run=None if finding.separating_run is None else separating_run(finding.separating_run),
    )


def run_rows(runs: Sequence[RunSummary]) -> tuple[RunRow, ...]:
    """The table of runs."""
    return tuple(
        RunRow(
            number=i + 1,
            bag=PurePath(run.bag).name or run.bag,
            path=run.bag,
            role=run.role.replace("_", " "),
            drive="–" if run.angular_frequency is None else f"{run.angular_frequency:.2f}",
            amplitude="–" if run.amplitude is None else f"{run.amplitude * 1e3:.1f}",
            samples=f"{run.samples:,}".replace(",", "\N{NARROW NO-BREAK SPACE}"),
            lost=str(run.lost),
            rate=f"{run.rate_hz:.1f}",
            session=run.session,
            delay="–" if run.encoder_delay_s is None else pretty(f"{run.encoder_delay_s * 1e3:.2f}"),
        )
        for i, run in enumerate(runs)
    )


def ranked_rows(result: LoopResult) -> tuple[RankedRow, ...]:
    """The models tried, best first; the one that the report claims is marked."""
    claimed = {*result.declared, *(f.effect for f in result.findings)} - {"bias"}
    return tuple(
        RankedRow(
            effects=" + ".join(("bias", *r.effects)),
            bic=pretty(f"{r.bic_difference:.1f}"),
            loglik=pretty(f"{-r.loglik_difference:+.1f}") if abs(r.loglik_difference) >= 0.05 else "0",
            best=i == 0,
            chosen=set(r.effects) == claimed,
        )
        for i, r in enumerate(result.ranking)
    )
