"""A report of close_loop as typed values: what a comparison needs of it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from math import inf, isfinite
from pathlib import Path
from typing import Any

import numpy as np

from gsense_fusion.comparison.contrast import as_identified
from gsense_fusion.identification.result import Covariance
from gsense_fusion.identification.types import IdentificationError, Parameter
from gsense_fusion.report.document import SCHEMA


class Presence(str, Enum):
    """What a report says of an effect."""

    DECLARED = "declared"
    FOUND = "found"
    NOT_FOUND = "not found"
    """Sought: estimate and error say how well it is excluded."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """One effect as one report has it."""

    effect: str
    presence: Presence
    parameters: Mapping[str, Parameter]
    covariance: Covariance | None = None
    """Of the parameters in which it is linear; reports of earlier versions have none."""
    owner: str | None = None
    alternatives: tuple[str, ...] = ()

    @property
    def present(self) -> bool:
        """Whether the model needs it: found, or declared and significant."""
        if self.presence is Presence.DECLARED:
            return any(p.significant for p in self.parameters.values())
        return self.presence is Presence.FOUND


@dataclass(frozen=True, eq=False)
class Snapshot:
    """One report."""

    path: str
    sensor: str
    unit_id: str | None
    declared: tuple[str, ...]
    verdict: str
    effects: Mapping[str, Estimate]
    unexplained: str | None
    """Its description."""
    rate_rms: Mapping[str, float]
    """raw, declared, full, noise_floor; rad/s."""
    noise: Mapping[str, Parameter]
    """By axis, rad/s/sqrt(Hz)."""
    delay: Parameter | None
    """Of the IMU against the encoder, s."""
    delays_s: tuple[float, ...]
    """Run by run."""
    rates_hz: tuple[float, ...]
    recordings: frozenset[tuple[str, int, int, float]]
    """Bag, samples, lost, rate: what tells one recording from another."""
    undecided: tuple[str, ...]


def load_snapshot(path: Path) -> Snapshot:
    """Read a report.

    Raises:
        IdentificationError: it cannot be read or is no report; one line.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise IdentificationError(f"{path}: {error.strerror or error}") from error
    except (ValueError, RecursionError) as error:  # no JSON, or no text
        raise IdentificationError(f"{path}: no report of close_loop ({error})") from error
    return snapshot(document, str(path))


def snapshot(document: Any, path: str) -> Snapshot:
    """A report's document (what report.json holds) as typed values; errors as `load_snapshot`."""
    schema = document.get("schema") if isinstance(document, dict) else None
    if schema != SCHEMA:
        raise IdentificationError(f"{path}: schema {schema!r} is not {SCHEMA}: name a report of close_loop")
    try:
        return _snapshot(document, path)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        text = f"{type(error).__name__}: {error}"
        raise IdentificationError(f"{path}: not a whole report ({text}); run close_loop anew") from error


def _snapshot(d: Mapping[str, Any], path: str) -> Snapshot:
    runs = d["runs"]
    unexplained = d["unexplained"]
    return Snapshot(
        path=path,
        sensor=str(d["sensor"]),
        unit_id=d["unit_id"],
        declared=tuple(d["declared"]),
        verdict=str(d["verdict"]),
        effects=_effects(d),
        unexplained=None if unexplained is None else str(unexplained["description"]),
        rate_rms={k: float(v) for k, v in d["rate_rms"].items() if k != "unit" and v is not None},
        noise={axis: _parameter(p) for axis, p in d.get("rest_noise", {}).items()},
        delay=None if d.get("encoder_delay") is None else _parameter(d["encoder_delay"]),
        delays_s=tuple(float(r["encoder_delay_s"]) for r in runs if r["encoder_delay_s"] is not None),
        rates_hz=tuple(float(r["rate_hz"]) for r in runs),
        recordings=frozenset((str(r["bag"]), r["samples"], r["lost"], r["rate_hz"]) for r in runs),
        undecided=tuple(d.get("undecided", ())),
    )


def _effects(d: Mapping[str, Any]) -> dict[str, Estimate]:
    spreads = {name: _covariance(c) for name, c in d.get("covariances", {}).items()}
    out: dict[str, Estimate] = {}
    for name, parameters in d.get("not_found", {}).items():
        spread = spreads.get(name)
        out[name] = Estimate(name, Presence.NOT_FOUND, _parameters(parameters, spread), spread)
    for name, parameters in d["declared_parameters"].items():
        spread = spreads.get(name)
        out[name] = Estimate(name, Presence.DECLARED, _parameters(parameters, spread), spread)
    for f in d["findings"]:
        name = str(f["effect"])
        spread = spreads.get(name)
        values, rivals = _parameters(f["parameters"], spread), tuple(f.get("alternatives", ()))
        out[name] = Estimate(name, Presence.FOUND, values, spread, str(f["owner"]), rivals)
    return out


def _parameters(values: Mapping[str, Any], spread: Covariance | None) -> dict[str, Parameter]:
    """As far as the data identifies them: in what else a report says of them, two reports are not alike."""
    out = {name: _parameter(p) for name, p in values.items()}
    if spread is not None and out.keys() >= set(spread.parameters):
        known = as_identified(np.array([out[n].value for n in spread.parameters]), spread)
        out |= {n: replace(out[n], value=float(x)) for n, x in zip(spread.parameters, known, strict=True)}
    return out


def _parameter(p: Mapping[str, Any]) -> Parameter:
    stderr = inf if p["stderr"] is None else float(p["stderr"])
    doubtful = p.get("significant") is False
    value = float(p["value"])
    if not isfinite(value) or not stderr >= 0.0:
        raise ValueError(f"{value} +- {stderr} is no estimate")
    return Parameter(value, stderr, str(p["unit"]), in_doubt=doubtful)


def _covariance(c: Mapping[str, Any]) -> Covariance:
    names = tuple(c["parameters"])
    matrix = np.array(c["matrix"], dtype=np.float64)
    plausible = np.array(c["plausible"], dtype=np.float64)
    if matrix.shape != (len(names), len(names)) or plausible.shape != (len(names),):
        raise ValueError(f"covariance of {len(names)} parameters has the shape {matrix.shape}")
    if not (np.isfinite(matrix).all() and np.isfinite(plausible).all() and (plausible > 0.0).all()):
        raise ValueError("covariance with values that are no variances")
    return Covariance(names, matrix, plausible)
