"""A ripple of belt teeth that grows with the speed: most of it lies above the band of the other effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse
from tests.study.simulator import Disturbance, PlannedRun
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.engine import Settings
from gsense_fusion.identification.noise import NoiseModel, Response
from gsense_fusion.identification.types import Owner

from .sessions import BASE, SETTINGS, analysed, finding, made, names

PLAN = (
    PlannedRun(1.0, 20.0),
    PlannedRun(0.0, 45.0),
    PlannedRun(1.5, 18.0),
    PlannedRun(3.1, 16.0, role="held_out"),
    PlannedRun(8.0, 16.0),
    PlannedRun(2.2, 16.0),
    PlannedRun(4.0, 16.0),
    PlannedRun(1.25, 16.0, role="held_out"),
)
AT_200_HZ = replace(BASE, plan=PLAN, chain=ChainParameters(rate_hz=200.0, filter_hz=42.0))
TEETH = Disturbance("teeth", 0.03 * DEG)
"""rad/s at 0.1 m/s."""


def test_the_filter_is_seen_in_the_noise() -> None:
    f = np.linspace(4.0, 100.0, 300)
    second_order = 1.0 / (1.0 + (f / 42.0) ** 4)
    response = Response.of({0: NoiseModel(1e-8, 1e-12, 1e-12, f, second_order)})
    assert response.at(np.array([10.0, 42.0, 80.0])) == pytest.approx([1.0, 0.71, 0.27], abs=0.02)
    assert response.at(np.array([200.0]))[0] == pytest.approx(0.27 * (80 / 200) ** 2, rel=0.1)
    flat = Response.of({0: NoiseModel(1e-8, 1e-12, 1e-12, f, np.ones_like(f))})
    assert flat.at(np.array([10.0, 300.0])) == pytest.approx([1.0, 1.0])


@pytest.mark.slow
def test_a_ripple_that_grows_with_the_speed_is_found_with_its_pitch_and_size() -> None:
    result = analysed(TEETH, base=AT_200_HZ)
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == ["belt_tooth"]
    found = finding(result, "belt_tooth")
    assert found.owner is Owner.RIG
    assert found.parameters["pitch"].value == pytest.approx(5.08e-3, abs=1e-5)
    angle = np.array([[found.parameters[f"angle_{f}_{x}"].value for x in "xyz"] for f in ("cos", "sin")])
    assert np.linalg.norm(angle) == pytest.approx(TEETH.size / 0.1, rel=0.2)
    assert any("above half" in n for n in result.notes), result.notes


@pytest.mark.slow
def test_without_teeth_in_the_catalogue_it_is_unexplained() -> None:
    toothless = tuple(e for e in CATALOGUE if "belt_tooth" not in (e.name, e.part_of))
    strong = made(Disturbance("teeth", 0.1 * DEG), base=AT_200_HZ)
    result = analyse(strong, Settings("mpu6050", catalogue=toothless))
    assert result.verdict == "unexplained", (result.verdict, names(result))


@pytest.mark.slow
def test_no_ripple_at_200_hz() -> None:
    result = analyse(made(base=AT_200_HZ), SETTINGS)
    assert result.verdict == "nothing_missing", (names(result), result.unexplained)
