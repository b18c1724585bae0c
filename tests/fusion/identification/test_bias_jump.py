"""The instant of a step of the bias, wherever in a run it falls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse
from tests.study.simulator.parameters import DEG

from gsense_fusion.bags.run import Run

from .sessions import SETTINGS, changed, finding, made, names

STRONG, WEAK = 0.1 * DEG, 0.05 * DEG


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "number", "into_motion_s"), [(STRONG, 0, 4.0), (STRONG, 0, 8.0), (WEAK, 2, 8.0), (WEAK, 2, 11.0)]
)
def test_a_step_within_a_run_is_dated(size: float, number: int, into_motion_s: float) -> None:
    """A few seconds from the gap before the motion, where a step explains the blocks nearly as well; in the middle of a
    block, where block means alone see no more than drift; behind the last whole block of a run."""
    session = made()
    first, *_ = sorted(run.imu.stamp_ns[0] for run, _ in session.runs)
    moving = [
        run for run, role in session.runs if role == "fit" and run.pose is not None and np.ptp(run.pose.position) > 0.1
    ][number]
    when = moving.imu.stamp_ns[0] + int(into_motion_s * 1e9)

    def change(run: Run, role: str) -> tuple[Run, str]:
        step = size * (run.imu.stamp_ns > when)
        return replace(run, imu=replace(run.imu, angular_rate=run.imu.angular_rate + step[:, None])), role

    result = analyse(changed(session, change), SETTINGS)
    assert names(result) == ["bias_jump"], result.unexplained
    found = finding(result, "bias_jump").parameters
    assert found["t0"].value == pytest.approx((when - first) * 1e-9, abs=max(0.05, 3 * found["t0"].stderr))
    for name in ("d_x", "d_y", "d_z"):
        assert found[name].value == pytest.approx(size, abs=3.5 * found[name].stderr)
