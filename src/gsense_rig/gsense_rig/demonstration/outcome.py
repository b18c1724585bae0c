"""What the loop found beside what was hidden: read from report.json, which is all that is known of close_loop here."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gsense_rig.demonstration.hidden import HiddenEffect
from gsense_rig.demonstration.processes import DemoError

DEG = 180.0 / math.pi
_HUMAN = {
    "rad/s/K": (DEG, "deg/s/K"),
    "rad/m": (DEG, "deg/m"),
    "rad/m^2": (DEG, "deg/m^2"),
    "rad/s": (DEG, "deg/s"),
    "s": (1e3, "ms"),
    "(rad/s)/(m/s^2)": (DEG * 9.80665, "deg/s/g"),
}
"""SI unit -> factor and the unit that people of the field use."""


@dataclass(frozen=True)
class Row:
    """One parameter; texts in units for people."""

    effect: str
    parameter: str
    hidden: str
    found: str
    unit: str


@dataclass(frozen=True)
class Outcome:
    """The comparison."""

    verdict: str
    found: tuple[str, ...]
    """Effects named."""
    hidden_found: bool
    others: tuple[str, ...]
    """Named though not hidden."""
    owners: tuple[str, ...]
    deviation: float | None
    """Of the hidden effect's estimate from the truth: largest over its parameters, in standard errors."""
    rows: tuple[Row, ...]
    rate_rms: Mapping[str, float]
    """rad/s: raw, declared, full, noise_floor."""


def read_report(path: Path) -> dict[str, Any]:
    """report.json; raises DemoError."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        schema = data["schema"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DemoError(f"{path}: is no report ({type(error).__name__}: {error})") from error
    if schema != "gsense-close-loop/1":
        raise DemoError(f"{path}: schema {schema!r} is not gsense-close-loop/1")
    return dict(data)


def compare(report: Mapping[str, Any], hidden: HiddenEffect) -> Outcome:
    """Puts a report beside the truth."""
    findings = {finding["effect"]: finding for finding in report["findings"]}
    own = findings.get(hidden.kind.name)
    rows = [_row(hidden, name, own["parameters"] if own else {}) for name in hidden.kind.parameters]
    others = tuple(name for name in findings if name != hidden.kind.name)
    for name in others:
        rows += [
            Row(name, parameter, "-", _estimate(values), _unit(values))
            for parameter, values in findings[name]["parameters"].items()
        ]
    return Outcome(
        verdict=report["verdict"],
        found=tuple(findings),
        hidden_found=own is not None,
        others=others,
        owners=tuple(finding["owner"] for finding in findings.values()),
        deviation=_deviation(hidden, own["parameters"]) if own else None,
        rows=tuple(rows),
        rate_rms={name: float(report["rate_rms"][name]) for name in ("raw", "declared", "full", "noise_floor")},
    )


def _row(hidden: HiddenEffect, name: str, parameters: Mapping[str, Any]) -> Row:
    factor, unit = _HUMAN.get(hidden.kind.unit, (1.0, hidden.kind.unit))
    truth = f"{hidden.value * factor:.4g}"
    if name not in parameters:
        return Row(hidden.kind.name, name, truth, "not found", unit)
    return Row(hidden.kind.name, name, truth, _estimate(parameters[name]), unit)


def _estimate(values: Mapping[str, Any]) -> str:
    """Value and standard error to the error's second digit."""
    factor, _ = _HUMAN.get(values["unit"], (1.0, ""))
    value, error = values["value"] * factor, values["stderr"]
    if error is None or not error > 0:
        return f"{value:.4g}"
    error *= factor
    digits = max(0, 1 - math.floor(math.log10(error)))
    return f"{value:.{digits}f} +- {error:.{digits}f}"


def _unit(values: Mapping[str, Any]) -> str:
    return _HUMAN.get(values["unit"], (1.0, str(values["unit"])))[1]


def _deviation(hidden: HiddenEffect, parameters: Mapping[str, Any]) -> float | None:
    errors = [
        abs(parameters[name]["value"] - truth) / parameters[name]["stderr"]
        for name, truth in hidden.truth.items()
        if name in parameters and parameters[name]["stderr"]
    ]
    return max(errors, default=None)
