"""An element that lags behind the thermometer does not start anew with every run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.signal import lfilter

from gsense_fusion.identification.drivers import TEMPERATURE_REFERENCE, lagged_starts, lagged_temperature
from gsense_fusion.identification.recording.integrity import CleanRun
from gsense_fusion.identification.types import FloatArray, Role

RATE_HZ = 50.0
LAG_S = 18.0
PAUSE_S = 6.0
RUN_S = 40.0


@dataclass(frozen=True, eq=False)
class _Data:
    run: CleanRun


def _temperature(t: FloatArray) -> FloatArray:
    """A fan that comes and goes over four minutes beside a warm-up, degrees Celsius."""
    return np.asarray(26.0 + 2.0 * (1 - np.exp(-t / 300.0)) + 0.8 * np.sin(2 * np.pi * t / 240.0))


def _run(number: int, session: int = 0) -> _Data:
    t = number * (RUN_S + PAUSE_S) + np.arange(0.0, RUN_S, 1.0 / RATE_HZ)
    zero = np.zeros((len(t), 3))
    return _Data(
        CleanRun(
            path="run", axes=(0, 1, 2), name=f"run {number}", role=Role.FIT, sensor="mpu6050", session=session, time=t,
            angular_rate=zero, specific_force=zero, valid=np.ones(len(t), dtype=bool), rate_hz=RATE_HZ,
            received=len(t), lost=0, pose_time=None, pose=None, temperature=_temperature(t),
        )
    )  # fmt: skip


def _true(t: FloatArray) -> FloatArray:
    fine = np.arange(-60.0, t[-1] + 0.1, 0.01)
    above = _temperature(np.maximum(fine, 0.0)) - TEMPERATURE_REFERENCE
    above += np.minimum(fine, 0.0) * (2.0 / 300.0 + 0.8 * 2 * np.pi / 240.0)  # as the first seconds tell it
    k = 1 - np.exp(-0.01 / LAG_S)
    start = above[0] - (above[1] - above[0]) / 0.01 * LAG_S
    return np.interp(t, fine, lfilter([k], [1.0, k - 1.0], above, zi=[start * (1 - k)])[0])


def test_what_one_run_leaves_the_next_begins_with() -> None:
    runs = [_run(i) for i in range(6)]
    starts = lagged_starts(runs[::-1], LAG_S)  # type: ignore[arg-type]
    anew = []
    for data in runs:
        run, true = data.run, _true(data.run.time)
        lagged, alone = lagged_temperature(run, LAG_S, starts[data]), lagged_temperature(run, LAG_S)  # type: ignore[index]
        assert lagged is not None
        assert alone is not None
        assert np.abs(lagged - true).max() < 0.03
        anew.append(np.abs(alone - true).max())
    assert max(anew) > 0.1


def test_a_new_session_begins_settled() -> None:
    first, other = _run(0), _run(3, session=1)
    starts = lagged_starts([first, other], LAG_S)  # type: ignore[list-item]
    alone = lagged_temperature(other.run, LAG_S)
    assert alone is not None
    assert lagged_temperature(other.run, LAG_S, starts[other]) == pytest.approx(alone)  # type: ignore[index]
