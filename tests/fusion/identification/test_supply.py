"""The supply of a run: a cell's readings lose their noise, a toggled supply keeps its steps."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.bags.run import ScalarSeries
from gsense_fusion.identification.recording.supply import supply_of

TIME = np.arange(0.0, 40.0, 0.005)
NOISE = 5e-3


def _found(volts: np.ndarray, seed: int) -> np.ndarray:
    at = np.arange(len(volts)) + 0.4
    noisy = volts + NOISE * np.random.default_rng(seed).standard_normal(len(volts))
    found = supply_of(ScalarSeries((at * 1e9).astype(np.int64) + 7, noisy), 7, TIME[: len(volts) * 200])
    assert found is not None
    return found


@pytest.mark.parametrize("seed", range(20))
def test_a_cells_readings_are_one_voltage(seed: int) -> None:
    found = _found(np.full(40, 4.07), seed)
    assert np.ptp(found) < 4 * NOISE  # a line at most
    assert found.mean() == pytest.approx(4.07, abs=4 * NOISE / np.sqrt(40))


def test_most_runs_of_a_cell_have_no_slope() -> None:
    assert sum(np.ptp(_found(np.full(40, 4.07), seed)) > 0 for seed in range(50)) <= 1


def test_a_discharge_that_shows_is_kept() -> None:
    found = _found(4.07 - 2e-3 * np.arange(40), 1)
    assert found[0] - found[-1] == pytest.approx(0.08, rel=0.1)


def test_a_toggled_supply_keeps_its_steps() -> None:
    volts = 4.0 + 0.2 * (np.arange(40) // 10 % 2)
    found = _found(volts, 2)
    assert found[int(5 / 0.005)] == pytest.approx(4.0, abs=0.01)
    assert found[int(15 / 0.005)] == pytest.approx(4.2, abs=0.01)


def test_too_few_readings_are_none() -> None:
    assert supply_of(ScalarSeries(np.arange(4, dtype=np.int64), np.ones(4)), 0, TIME) is None
