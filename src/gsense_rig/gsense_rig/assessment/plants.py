"""Plants that differ from the controller's belief."""

from __future__ import annotations

import itertools
from dataclasses import replace

from gsense_rig.plant.parameters import DriveParameters, PlantParameters

# What belongs together changes together; the corners are all combinations of these.
CORNER_GROUPS = (
    ("carriage_mass",),
    ("coulomb_friction", "static_friction", "viscous_friction"),
    ("resistance",),
    ("motor_constant",),
)
# Each of these alone, up and down. The supply is none of the corners: 20 % less of it cannot drive a motor with 20 %
# more back EMF at 8 rad/s, whoever controls it.
ALONE = (
    "supply_voltage", "gear_efficiency", "rotor_inertia", "rotor_coulomb", "static_friction", "dead_zone",
    "belt_stiffness", "belt_damping", "inductance", "stribeck_speed",
)  # fmt: skip
NOMINAL = "as believed"


def changed(factors: dict[str, float]) -> PlantParameters:
    """The nominal plant with some of its drive's numbers multiplied; an efficiency stays below 1."""
    drive = DriveParameters()
    values = {name: getattr(drive, name) * factor for name, factor in factors.items()}
    if "gear_efficiency" in values:
        values["gear_efficiency"] = min(values["gear_efficiency"], 0.98)
    return PlantParameters(drive=replace(drive, **values))


def corners(off: float) -> dict[str, PlantParameters]:
    """All combinations of the corner groups, each up or down by a share `off`; by name."""
    plants = {}
    for signs in itertools.product((-1, 1), repeat=len(CORNER_GROUPS)):
        factors = {name: 1.0 + sign * off for sign, group in zip(signs, CORNER_GROUPS, strict=True) for name in group}
        label = ", ".join(f"{group[0]} {sign * off:+.0%}" for sign, group in zip(signs, CORNER_GROUPS, strict=True))
        plants[label] = changed(factors)
    return plants


def one_by_one(off: float) -> dict[str, PlantParameters]:
    """Each of ALONE up and down by a share `off`; by name."""
    return {f"{name} {sign * off:+.0%}": changed({name: 1.0 + sign * off}) for name in ALONE for sign in (-1, 1)}


def all_plants(off: float) -> dict[str, PlantParameters]:
    """The nominal plant, the corners and the single changes."""
    return {NOMINAL: PlantParameters(), **corners(off), **one_by_one(off)}
