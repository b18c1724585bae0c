"""What the rounding of a coarse converter can make by itself."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.effects.quantization import Rounding
from gsense_fusion.identification.noise.spectrum import NoiseModel

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


def test_behind_a_narrow_filter_rounding_is_no_noise_to_compare_with() -> None:
    """What rounding spreads to high frequencies depends on how fast the signal moves through the steps."""
    corner = np.array([4.0, 10.0, 20.0, 40.0, 80.0])
    filtered = NoiseModel(8e-9, 0.0, 0.0, corner, np.array([1.0, 0.5, 0.1, 0.03, 0.03]), rounding=4e-10)
    assert filtered.usable(np.array([1.0, 8.0, 15.0]), 0.02).all()
    assert not filtered.usable(np.array([30.0, 70.0]), 0.02).any()
