"""What was not measured is no error of the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.errors.predict import bridged

from .sessions import SETTINGS, analysed, changed, made

GAPS_S = ((5.0, 5.6), (9.2, 9.9))


def _with_gaps(run: Run, role: str) -> tuple[Run, str]:
    if role != "held_out":
        return run, role
    imu = run.imu
    kept = ~np.any([(imu.seconds > start) & (imu.seconds < stop) for start, stop in GAPS_S], axis=0)
    series = {name: getattr(imu, name)[kept] for name in ("stamp_ns", "received_ns", "angular_rate", "specific_force")}
    return replace(run, imu=replace(imu, **series)), role


@pytest.mark.slow
def test_gaps_of_held_out_runs_leave_the_error_after_as_it_is() -> None:
    whole, holed = analysed().rate_rms, analyse(changed(made(), _with_gaps), SETTINGS).rate_rms
    assert whole.declared < 0.5 * whole.raw
    assert holed.declared == pytest.approx(whole.declared, rel=0.1)


def test_a_line_through_a_long_gap_does_not_carry_single_samples_noise() -> None:
    noise = np.random.default_rng(1).standard_normal((24000, 3))
    places = np.arange(len(noise))
    for length, most in ((1, 1.0), (400, 0.1)):
        known = places % 1200 < 1200 - length
        line = bridged(noise, known)
        assert np.array_equal(line[known], noise[known])
        assert np.sqrt(np.mean(line[~known] ** 2)) < most


def test_a_gap_at_an_end_goes_on_level() -> None:
    ramp = np.repeat(np.arange(10.0)[:, None], 3, axis=1)
    line = bridged(ramp, np.arange(10) < 8)
    assert np.array_equal(line[8:], np.full((2, 3), 6.5))
