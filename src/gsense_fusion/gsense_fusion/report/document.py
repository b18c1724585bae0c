"""report.json (schema gsense-close-loop/1) from a result."""

from __future__ import annotations

import json
from collections.abc import Mapping
from math import isfinite
from typing import Any

from gsense_fusion.identification.errors.metrics import Rms
from gsense_fusion.identification.result import Finding, LoopResult, RunSummary, Unexplained
from gsense_fusion.identification.types import Parameter

SCHEMA = "gsense-close-loop/1"


def report_document(result: LoopResult) -> dict[str, Any]:
    """The content of report.json; what follows attitude_rms is added to what the interface contract asks for."""
    return {
        "schema": SCHEMA,
        "sensor": result.sensor,
        "unit_id": result.unit_id,
        "declared": list(result.declared),
        "declared_parameters": {
            effect: {name: _parameter(p, significant=True) for name, p in parameters.items()}
            for effect, parameters in result.declared_parameters.items()
        },
        "runs": [_run(run) for run in result.runs],
        "verdict": result.verdict,
        "findings": [_finding(finding) for finding in result.findings],
        "unexplained": None if result.unexplained is None else _unexplained(result.unexplained),
        "rate_rms": _rms(result.rate_rms, "rad/s"),
        "pose_rms": None if result.pose_rms is None else _rms(result.pose_rms, "rad/s"),
        "attitude_rms": {
            "gyro_only": None if result.attitude_gyro_only is None else _rms(result.attitude_gyro_only),
            "madgwick": None if result.attitude_madgwick is None else _rms(result.attitude_madgwick),
            "unit": "rad",
        },
        "not_found": {
            effect: {name: _parameter(p) for name, p in parameters.items()}
            for effect, parameters in result.not_found.items()
        },
        "covariances": {
            effect: {"parameters": list(c.parameters), "matrix": c.matrix.tolist(), "plausible": c.plausible.tolist()}
            for effect, c in result.covariances.items()
        },
        "encoder_delay": None if result.encoder_delay is None else _parameter(result.encoder_delay),
        "rest_noise": {axis: _parameter(p) for axis, p in result.rest_noise.items()},
        "undecided": list(result.undecided),
        "deciding_runs": dict(result.deciding_runs),
        "notes": list(result.notes),
    }


def report_json(result: LoopResult) -> str:
    """report.json as text."""
    return json.dumps(plain(report_document(result)), indent=1, allow_nan=False) + "\n"


def _parameter(parameter: Parameter, *, significant: bool = False) -> dict[str, Any]:
    out: dict[str, Any] = {"value": parameter.value, "stderr": parameter.stderr, "unit": parameter.unit}
    if significant:
        out["significant"] = parameter.significant
    return out


def _run(run: RunSummary) -> dict[str, Any]:
    return {
        "bag": run.bag,
        "role": run.role,
        "samples": run.samples,
        "lost": run.lost,
        "rate_hz": run.rate_hz,
        "session": run.session,
        "angular_frequency": run.angular_frequency,
        "amplitude": run.amplitude,
        "encoder_delay_s": run.encoder_delay_s,
    }


def _finding(finding: Finding) -> dict[str, Any]:
    return {
        "effect": finding.effect,
        "owner": finding.owner.value,
        "axes": list(finding.axes),
        "parameters": {name: _parameter(p) for name, p in finding.parameters.items()},
        "p_value": finding.p_value,
        "rate_rms_before": finding.rate_rms_before,
        "rate_rms_after": finding.rate_rms_after,
        "alternatives": list(finding.alternatives),
        "separating_run": finding.separating_run,
    }


def _unexplained(unexplained: Unexplained) -> dict[str, Any]:
    return {
        "axes": list(unexplained.axes),
        "rate_rms": unexplained.rate_rms,
        "description": unexplained.description,
        "frequencies": list(unexplained.frequencies),
        "nearest_effects": list(unexplained.nearest_effects),
    }


def _rms(rms: Rms, unit: str | None = None) -> dict[str, Any]:
    out: dict[str, Any] = {"raw": rms.raw, "declared": rms.declared, "full": rms.full}
    if rms.noise_floor is not None:
        out["noise_floor"] = rms.noise_floor
    return out if unit is None else {**out, "unit": unit}


def plain(value: Any) -> Any:
    """A document for JSON: numpy's scalars as Python's; what is not finite (an unbounded error) as null."""
    if isinstance(value, Mapping):
        return {k: plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if isinstance(value, bool | str) or value is None:
        return value
    if hasattr(value, "item"):
        value = value.item()
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value
