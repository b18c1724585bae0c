"""compensation.yaml and next_plan.yaml from a result."""

from __future__ import annotations

from typing import Any

import yaml

from gsense_fusion.compensation import (
    CompensationFile,
    GSensitivity,
    Matrix,
    ReferenceTerm,
    TemperatureBias,
    Term,
    Vector,
)
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import Owner, Parameter

SEPARATING_RUNS: dict[str, list[dict[str, Any]]] = {
    "board_turned_180": [
        {"shape": "sine", "amplitude": 0.15, "angular_frequency": w, "duration": 24.0, "mounting": 180, "role": r}
        for w, r in ((3.0, "fit"), (5.0, "held_out"), (6.0, "fit"), (8.0, "fit"))
    ],
    "board_turned_90": [
        {"shape": "sine", "amplitude": 0.15, "angular_frequency": w, "duration": 24.0, "mounting": 90, "role": "fit"}
        for w in (4.0, 6.0, 8.0)
    ],
    "temperature_soak": [{"shape": "static", "duration": 600.0, "mounting": 0, "position": 0.0, "role": "fit"}],
    "long_rest": [{"shape": "static", "duration": 7200.0, "mounting": 0, "position": 0.0, "role": "fit"}],
    "small_stroke": [
        {"shape": "sine", "amplitude": 0.05, "angular_frequency": w, "duration": 24.0, "mounting": 0, "role": "fit"}
        for w in (4.0, 6.0, 8.0)
    ],
}
"""Runs that separate rivals, by the name of the separating run; each plan begins with a run at rest."""
REST: dict[str, Any] = {"shape": "static", "duration": 60.0, "mounting": 0, "position": 0.0, "role": "fit"}


def compensation(result: LoopResult) -> CompensationFile:
    """What the fusion node subtracts: significant effects of the sensor; the rig's rotations stand apart."""
    terms: list[Term] = []
    if result.g_matrix is not None:
        rows: list[Vector] = [(r[0], r[1], r[2]) for r in result.g_matrix]
        matrix: Matrix = (rows[0], rows[1], rows[2])
        terms.append(GSensitivity(matrix=matrix))
    delay = 0.0
    reference: list[ReferenceTerm] = []
    parameters = {f.effect: (f.owner, f.parameters) for f in result.findings}
    for name in result.declared:
        if name in result.declared_parameters and any(p.significant for p in result.declared_parameters[name].values()):
            parameters.setdefault(name, (Owner.SENSOR, result.declared_parameters[name]))
    if "temperature_bias" in parameters:
        values = parameters["temperature_bias"][1]
        lag = values["lag_s"].value if "lag_s" in values else 0.0
        terms.append(TemperatureBias(_vector(values, "c"), result.temperature_reference, lag))
    if "time_offset" in parameters:
        delay = parameters["time_offset"][1]["tau"].value
    if "rail_curvature" in parameters:
        values = parameters["rail_curvature"][1]
        reference.append(ReferenceTerm("rail_curvature", {"t": _vector(values, "t"), "u": _vector(values, "u")}))
    return CompensationFile(
        sensor=result.sensor.strip("/").split("/")[0] or result.sensor,
        unit_id=result.unit_id,
        bias=result.bias,
        terms=tuple(terms),
        gyro_delay_s=delay,
        reference=tuple(reference),
    )


def _vector(parameters: Any, letter: str) -> Vector:
    values: dict[str, Parameter] = dict(parameters)
    return values[f"{letter}_x"].value, values[f"{letter}_y"].value, values[f"{letter}_z"].value


def next_plan(result: LoopResult) -> str | None:
    """A plan for `campaign` that separates the listed rivals; None where there are none."""
    wanted = [f.separating_run for f in result.findings if f.alternatives and f.separating_run in SEPARATING_RUNS]
    if not wanted:
        return None
    runs = [REST]
    for name in dict.fromkeys(wanted):
        runs += SEPARATING_RUNS[str(name)]
    rivals = "; ".join(f"{f.effect} or {', '.join(f.alternatives)}" for f in result.findings if f.alternatives)
    return f"# separates {rivals}\n" + yaml.safe_dump({"runs": runs}, sort_keys=False, default_flow_style=None)
