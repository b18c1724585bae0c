"""The report's figures, computed again from the words of the interface contract."""

from __future__ import annotations

import numpy as np
import pytest
from tests.study.reference import held_out_rms, measured_rates

from .sessions import BASE, BOW, TEMPERATURE, G, analysed, made


@pytest.mark.slow
def test_raw_is_the_bias_alone() -> None:
    session = made(TEMPERATURE, BOW)
    assert analysed(TEMPERATURE, BOW).rate_rms.raw == pytest.approx(
        held_out_rms(session, measured_rates(session)), rel=2e-3
    )


def test_declared_with_the_true_g_comes_to_the_same() -> None:
    """The declared model's G is a fit, so its figure may differ from the true G's by the fit's error alone."""
    session = made()
    errors = [
        run.imu.angular_rate - truth.force @ np.array(G).T
        for (run, _), truth in zip(session.runs, session.truth, strict=True)
    ]
    assert analysed().rate_rms.declared == pytest.approx(held_out_rms(session, errors), rel=0.03)


def test_full_is_declared_without_findings() -> None:
    result = analysed()
    assert result.findings == ()
    assert result.rate_rms.full == result.rate_rms.declared


def test_no_pose_rms_without_six_still_stretches() -> None:
    held = [t for t, (_, role) in zip(made().truth, made().runs, strict=True) if role == "held_out"]
    result = analysed()
    assert (result.pose_rms is None) == (2 * len(held) < 6)


def test_runs_are_described() -> None:
    session, result = made(), analysed()
    by_name = {run.name: (run, role) for run, role in session.runs}
    assert len(result.runs) == len(session.runs)
    for summary in result.runs:
        run, role = by_name[summary.bag.rsplit("/", 1)[-1]]
        plan = session.truth[[r.name for r, _ in session.runs].index(run.name)].plan
        assert summary.role == role
        assert summary.samples == len(run.imu)
        assert summary.rate_hz == pytest.approx(BASE.chain.rate_hz, rel=1e-3)
        assert summary.session == 0
        if plan.angular_frequency == 0:
            assert summary.angular_frequency is None
            assert summary.amplitude is None
        else:
            assert summary.angular_frequency == pytest.approx(plan.angular_frequency, rel=1e-3)
            assert summary.amplitude == pytest.approx(plan.amplitude, rel=0.05)
