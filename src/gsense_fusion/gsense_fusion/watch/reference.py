"""True rotations of the rig that the compensation file knows: part of the predicted rate, never taken off the gyro."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsense_fusion.compensation import ReferenceTerm
from gsense_fusion.identification.effects.base import Drivers, Effect
from gsense_fusion.identification.types import FloatArray


def true_rate(terms: Sequence[ReferenceTerm], drivers: Drivers, catalogue: Sequence[Effect]) -> FloatArray:
    """Rate of the carriage's true rotation, rad/s, shape (n, 3), sensor axes; zero where it cannot be known."""
    out = np.zeros((len(drivers), 3))
    for term in terms:
        effect = next((e for e in catalogue if e.name == term.effect), None)
        if effect is None or effect.missing(drivers) is not None:
            continue
        parts = [e for e in catalogue if term.effect in (e.name, e.part_of)]
        templates = drivers.templates
        for spec in (spec for part in parts for spec in part.templates):
            if spec.name in term.parameters:
                templates = templates.set(spec.field, float(np.asarray(term.parameters[spec.name]).item()))
        for part in parts:
            beta = np.array([_value(term, spec.name) for spec in part.parameters])
            out += part.design(replace(drivers, templates=templates)) @ beta
    return out


def _value(term: ReferenceTerm, name: str) -> float:
    """`t_y` of a catalogue's effect is the second element of the file's `t`."""
    group, _, axis = name.rpartition("_")
    vector = term.parameters.get(group)
    return 0.0 if vector is None or axis not in "xyz" else float(np.asarray(vector)["xyz".index(axis)])
