"""compensation.yaml from a result."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import Owner, Parameter


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
            inertia = values["inertia"].value if "inertia" in values else 0.0
            found = [FrictionPickup(_vector(values, "c"), inertia)]
            if "drag" in values:
                x, y, z = (values["drag"].value * c for c in _vector(values, "c"))
                found.append(SpeedPickup((x, y, z)))
        case "speed_pickup":
            found = [SpeedPickup(_vector(values, "c"))]
        case "g_squared" if d is not None:
            found = [GSquared(_vector(values, "c"), d, higher=_higher_order(values))]
        case "g_cubed" if d is not None:
            found = [GCubed(_vector(values, "c"), d, higher=_higher_order(values))]
        case "jerk_coupling" if d is not None:
            lag = values["lag"].value if "lag" in values else 0.0
            found = [JerkCoupling(_vector(values, "c"), d, lag_s=lag)]
        case "g_resonance" if d is not None:
            modes = [n for n in ("", "2") if f"c{n}_x" in values]
            found = [_mode(values, d, number) for number in modes]
    return found


def _higher_order(values: Mapping[str, Parameter]) -> Vector | None:
    """What the search bought beside the power itself."""
    return _vector(values, "h") if "h_x" in values else None


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
