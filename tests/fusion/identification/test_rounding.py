"""What the rounding of a coarse converter can make by itself."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from gsense_fusion.identification.effects.quantization import Rounding
from gsense_fusion.identification.engine import beyond_rounding
from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.verdict.claims import Claims
from gsense_fusion.identification.verdict.sufficiency import Symptom

STEP = 0.01
ROUNDED = Rounding(np.array([STEP, STEP, 0.0]), np.array([0.9, 0.1, 0.0]), np.zeros((0, 3)))
"""Coarse on x, blurred by its noise on y, no lattice on z."""


@pytest.mark.parametrize(
    ("axes", "size", "somewhere", "made"),
    [
        (("x",), 0.99 * STEP / np.sqrt(12), False, True),
        (("x",), 1.01 * STEP / np.sqrt(12), False, False),
        (("x",), 0.99 * STEP / 2, True, True),
        (("x",), 1.01 * STEP / 2, True, False),
        (("y",), 0.1 * STEP, False, False),
        (("x", "z"), 0.1 * STEP, True, False),
        ((), 0.0, False, False),
    ],
)
def test_rounding_makes_what_is_smaller_than_its_error(
    axes: tuple[str, ...], size: float, somewhere: bool, made: bool
) -> None:
    assert ROUNDED.makes(axes, float(size), somewhere) is made


@pytest.mark.parametrize(
    ("kind", "axes", "wandered", "left"),
    [
        ("drift", ("x",), 0.2 * STEP, False),
        ("course", ("x",), 0.2 * STEP, False),
        ("course", ("x",), 0.4 * STEP, True),
        ("course", ("x", "y"), 0.05 * STEP, True),
        ("band", ("x",), 0.2 * STEP, True),
    ],
)
def test_a_bias_within_its_step_neither_drifts_nor_follows_anything(
    kind: str, axes: tuple[str, ...], wandered: float, left: bool
) -> None:
    """Rounding holds the mean at rest and lets it go in motion: a walk's strength makes more of that than there is."""
    symptom = Symptom(kind, axes, 1e-9, 0.8 * STEP, (), "the bias wanders")
    claims = Claims(cast(Fit, None), {}, (), (symptom,), ("g_squared",), ())
    found = beyond_rounding(claims, ROUNDED, np.array([wandered, 0.0, 0.0]))
    assert bool(found.symptoms) is left
    assert bool(found.nearest) is left
    assert beyond_rounding(claims, None, np.full(3, wandered)) is claims


def test_behind_a_narrow_filter_rounding_is_no_noise_to_compare_with() -> None:
    """What rounding spreads to high frequencies depends on how fast the signal moves through the steps."""
    corner = np.array([4.0, 10.0, 20.0, 40.0, 80.0])
    filtered = NoiseModel(8e-9, 0.0, 0.0, corner, np.array([1.0, 0.5, 0.1, 0.03, 0.03]), rounding=4e-10)
    assert filtered.usable(np.array([1.0, 8.0, 15.0]), 0.02).all()
    assert not filtered.usable(np.array([30.0, 70.0]), 0.02).any()
