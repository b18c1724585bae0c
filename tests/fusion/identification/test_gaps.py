"""What was not measured is no error of the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse

from gsense_fusion.bags.run import Run

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
