"""A curve of the acceleration that leaves the pure power: one finding with its next order, not several effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.compensation import GCubed
from gsense_fusion.report.outputs import compensation

from .sessions import BASE, analysed, finding, names

STROKE = np.linspace(-9.0, 9.0, 181)
"""m/s^2, what the fastest run reaches."""
SIZE = 4.0 * DEG


def _beyond_linear(curve: np.ndarray) -> np.ndarray:
    """What G cannot take up of a curve over the stroke."""
    return np.asarray(curve - STROKE * (STROKE @ curve) / (STROKE @ STROKE))


@pytest.mark.slow
def test_a_large_cube_that_saturates_is_one_finding_and_its_curve_is_compensated() -> None:
    base = replace(BASE, seed=7, chain=ChainParameters(rate_hz=100.0))
    result = analysed(Disturbance("hard_spring", SIZE), base=base)
    assert (names(result), result.verdict) == (["g_cubed"], "effects_found")
    assert "h_x" in finding(result, "g_cubed").parameters
    (term,) = (t for t in compensation(result).terms if isinstance(t, GCubed))
    assert term.c is not None
    assert term.higher is not None
    made = np.outer(STROKE**3, term.c) + np.outer(STROKE**5, term.higher)
    # an arctangent: neither the engine's polynomial nor as large as a pure cube at the ends
    true = _beyond_linear(SIZE * np.abs(np.arctan(0.08 * STROKE) / 0.8 - STROKE / 10.0) * np.sign(STROKE))
    found = _beyond_linear(np.linalg.norm(made, axis=1) * np.sign(STROKE))
    assert np.std(found - true) < 0.03 * np.std(true)
