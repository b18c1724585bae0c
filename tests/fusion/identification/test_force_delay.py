"""A delay of G f beside a pick-up that is not delayed: what is named instead has it for a rival."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse
from tests.study.simulator import Disturbance

from gsense_fusion.bags.run import Run

from .sessions import SETTINGS, changed, made, names


@pytest.mark.slow
def test_a_late_force_beside_a_prompt_pickup_is_among_the_rivals() -> None:
    def pickup(run: Run, role: str) -> tuple[Run, str]:
        assert run.pose is not None
        step = np.convolve(np.gradient(run.pose.position), np.ones(5) / 5, "same")
        sign = np.tanh(step / 2e-5)
        felt = np.interp(run.imu.stamp_ns, run.pose.stamp_ns, sign)
        rate = run.imu.angular_rate + np.outer(felt, [1e-4, -8e-5, 2e-4])
        return replace(run, imu=replace(run.imu, angular_rate=rate)), role

    result = analyse(changed(made(Disturbance("time_offset", 0.02)), pickup), SETTINGS)
    assert "friction_pickup" in names(result)
    named = [{f.effect, *f.alternatives} for f in result.findings]
    assert any("time_offset" in n for n in named), named
