"""compensation.yaml and next_plan.yaml from a result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

from gsense_fusion.bags.topics import sensor_name
from gsense_fusion.compensation import (
    CompensationFile,
    FrictionPickup,
    GCubed,
    GResonance,
    GSensitivity,
    GSquared,
    JerkCoupling,
    Matrix,
    ReferenceTerm,
    SpeedPickup,
    SupplyVoltage,
    TemperatureBias,
    Term,
    Vector,
)
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.result import Finding, LoopResult
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
SEPARATING_RUNS["supply_toggled"] = [
    {"shape": "static", "duration": 240.0, "mounting": 0, "position": 0.0, "role": r} for r in ("fit", "held_out")
]
SEPARATING_RUNS["motor_beside_board"] = [
    {"shape": "sine", "amplitude": 0.15, "angular_frequency": w, "duration": 24.0, "mounting": 0, "role": "fit"}
    for w in (2.0, 4.0, 8.0)
]
BY_HAND = {
    "supply_toggled": "toggle the board's supply by 0.2 V every 30 s during the long rests",
    "motor_beside_board": "lay the board still beside the rail during the motion, as near to the motor as it was",
    "temperature_soak": "warm the board by 10 K and let it cool down during the long rest",
}
"""What a person does in a separating run that a plan cannot say."""
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
    for name, (owner, values) in parameters.items():
        if name == "mag_position":
            continue  # bends the heading, turns nothing
        if owner is Owner.RIG:
            reference.append(ReferenceTerm(name, _grouped(values)))
        elif name == "time_offset":
            delay = values["tau"].value
        else:
            terms += _terms(name, values, result)
    return CompensationFile(
        sensor=sensor_name(result.sensor),
        unit_id=result.unit_id,
        bias=result.bias,
        terms=tuple(terms),
        gyro_delay_s=delay,
        reference=tuple(reference),
    )


def _terms(name: str, values: Mapping[str, Parameter], result: LoopResult) -> list[Term]:
    """What is subtracted for an effect: nothing for a jump, a tone, noise; more than one term where it has parts."""
    found: list[Term] = []
    d = result.direction
    match name:
        case "temperature_bias":
            lag = values["lag_s"].value if "lag_s" in values else 0.0
            found = [TemperatureBias(_vector(values, "c"), result.temperature_reference, lag)]
        case "supply_voltage" if result.supply_reference is not None:
            found = [SupplyVoltage(_vector(values, "c"), result.supply_reference)]
        case "friction_pickup":
            found = [FrictionPickup(_vector(values, "c"))]
            if "drag" in values:
                x, y, z = (values["drag"].value * c for c in _vector(values, "c"))
                found.append(SpeedPickup((x, y, z)))
        case "speed_pickup":
            found = [SpeedPickup(_vector(values, "c"))]
        case "g_squared" if d is not None:
            found = [GSquared(_vector(values, "c"), d)]
        case "g_cubed" if d is not None:
            found = [GCubed(_vector(values, "c"), d)]
        case "jerk_coupling" if d is not None:
            lag = values["lag"].value if "lag" in values else 0.0
            found = [JerkCoupling(_vector(values, "c"), d, lag_s=lag)]
        case "g_resonance" if d is not None:
            modes = [n for n in ("", "2") if f"c{n}_x" in values]
            found = [_mode(values, d, number) for number in modes]
    return found


def _mode(values: Mapping[str, Parameter], direction: Vector, number: str) -> GResonance:
    """One mode of the mount; `number` is what its parameters' names end with."""
    f0, damping = values[f"f{number or 0}"].value, values[f"damping{number}"].value
    rate = _vector(values, f"rate{number}") if f"rate{number}_x" in values else None
    return GResonance(_vector(values, f"c{number}"), direction, f0, damping, rate)


def _grouped(values: Mapping[str, Parameter]) -> dict[str, Vector | float]:
    """Parameters by letter: c_x, c_y, c_z become one vector c, others stay numbers."""
    letters = dict.fromkeys(n[:-2] for n in values if n.endswith(("_x", "_y", "_z")))
    vectors: dict[str, Vector | float] = {letter: _vector(values, letter) for letter in letters}
    return {**vectors, **{n: p.value for n, p in values.items() if not n.endswith(("_x", "_y", "_z"))}}


def _vector(parameters: Any, letter: str) -> Vector:
    values: dict[str, Parameter] = dict(parameters)
    return values[f"{letter}_x"].value, values[f"{letter}_y"].value, values[f"{letter}_z"].value


def next_plan(result: LoopResult) -> str | None:
    """A plan for `campaign` that separates the listed rivals; None where there are none."""
    open_ones = [f for f in result.findings if f.alternatives and f.separating_run in SEPARATING_RUNS]
    if not open_ones:
        return None
    runs = [REST]
    for finding in open_ones:
        runs += [run for run in _separating_runs(finding) if run not in runs]
    rivals = "; ".join(f"{f.effect} or {', '.join(f.alternatives)}" for f in result.findings if f.alternatives)
    wanted = dict.fromkeys(f.separating_run for f in open_ones)
    hands = "".join(f"# {name}: {BY_HAND[name]}\n" for name in wanted if name in BY_HAND)
    return f"# separates {rivals}\n{hands}" + yaml.safe_dump({"runs": runs}, sort_keys=False, default_flow_style=None)


def _separating_runs(finding: Finding) -> list[dict[str, Any]]:
    """The runs that separate a finding from its rivals.

    By 90 degrees about the vertical the force comes to another axis of the sensor, which may answer otherwise: where
    the rig may turn, the board is laid on its side instead, and the force keeps its axis.
    """
    runs = SEPARATING_RUNS[str(finding.separating_run)]
    turning = {e.name for e in CATALOGUE if e.owner is Owner.RIG} & {finding.effect, *finding.alternatives}
    if finding.separating_run == "board_turned_90" and turning:
        return [{**run, "mounting": "tilt_x"} for run in runs]
    return runs
