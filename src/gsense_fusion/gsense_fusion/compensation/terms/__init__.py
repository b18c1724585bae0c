"""The terms that are subtracted from the angular rate: one small class an effect, named as in the catalogue.

A class holds the effect's parameters, reads and writes its entry of compensation.yaml, and gives the row of numbers
that the kernel works on. Adding a term touches its class, `TERMS`, and one branch of the kernel.
"""

from __future__ import annotations

from typing import Any

from gsense_fusion.compensation.document import Section
from gsense_fusion.compensation.terms.board import SupplyVoltage, TemperatureBias
from gsense_fusion.compensation.terms.carriage import FrictionPickup, SpeedPickup
from gsense_fusion.compensation.terms.force import GCubed, GResonance, GSensitivity, GSquared, JerkCoupling
from gsense_fusion.compensation.terms.scale import ScaleMisalignment

__all__ = [
    "TERMS",
    "FrictionPickup",
    "GCubed",
    "GResonance",
    "GSensitivity",
    "GSquared",
    "JerkCoupling",
    "ScaleMisalignment",
    "SpeedPickup",
    "SupplyVoltage",
    "TemperatureBias",
    "Term",
    "parse_term",
    "term_document",
]

Term = (
    GSensitivity
    | GSquared
    | GCubed
    | JerkCoupling
    | GResonance
    | TemperatureBias
    | SupplyVoltage
    | FrictionPickup
    | SpeedPickup
    | ScaleMisalignment
)
_KINDS: tuple[type[Term], ...] = (
    GSensitivity,
    GSquared,
    GCubed,
    JerkCoupling,
    GResonance,
    TemperatureBias,
    SupplyVoltage,
    FrictionPickup,
    SpeedPickup,
    ScaleMisalignment,
)
TERMS: dict[str, type[Term]] = {kind.effect: kind for kind in _KINDS}
"""Every term by the name of its effect."""


def parse_term(section: Section) -> Term:
    """One entry of `terms`.

    Raises:
        ValueError: an unknown effect, or keys or values that it cannot have.
    """
    effect = section.text("effect")
    if effect not in TERMS:
        raise ValueError(f"{section.path}effect: {effect!r} is not known; known: {', '.join(sorted(TERMS))}")
    kind = TERMS[effect]
    section.unit(kind.unit)
    try:
        term: Term = kind.parse(section)
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(section.path) else f"{section.path}{text}") from error
    section.no_others()
    return term


def term_document(term: Term) -> dict[str, Any]:
    """The entry of a term."""
    return {"effect": term.effect, **term.document(), "unit": term.unit}
