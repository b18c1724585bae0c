"""Play of the bearings (Bouc and Wen's hysteresis, no exponential) at its typical size and far below."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.identification.types import Owner

from .sessions import BASE, analysed, finding, names

AT_200_HZ = replace(BASE, chain=ChainParameters(rate_hz=200.0, filter_hz=42.0))


@pytest.mark.slow
def test_play_of_a_typical_size_is_found_with_its_turn() -> None:
    play = Disturbance("bearing_play", 0.01 * DEG)
    result = analysed(play, base=AT_200_HZ)
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == ["reversal_rock"]
    found = finding(result, "reversal_rock")
    assert found.owner is Owner.RIG
    turn = np.array([found.parameters[f"r_{x}"].value for x in "xyz"])
    assert np.linalg.norm(turn) == pytest.approx(play.size, rel=0.15)
    assert 2e-4 < found.parameters["width"].value < 8e-4


@pytest.mark.slow
def test_play_below_what_a_session_can_show_is_not_claimed() -> None:
    result = analysed(Disturbance("bearing_play", 0.00003 * DEG), base=AT_200_HZ)
    assert result.verdict == "nothing_missing", (names(result), result.unexplained)
