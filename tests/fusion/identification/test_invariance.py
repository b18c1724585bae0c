"""What must not change the verdict (axes, origin of time, order of runs, losses), and what is said when data lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse

from gsense_fusion.bags.run import Run

from .sessions import BASE, BOW, SETTINGS, TEMPERATURE, analysed, changed, finding, in_axes, made, names

FRAME = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]])
"""Axes exchanged in a cycle, two of them reversed."""


def test_sensor_axes() -> None:
    rotation = FRAME
    result = analyse(changed(made(TEMPERATURE, BOW), lambda run, role: (in_axes(run, rotation), role)), SETTINGS)
    before = analysed(TEMPERATURE, BOW)
    assert (result.verdict, names(result)) == (before.verdict, names(before))

    def c(of: object) -> np.ndarray:
        return np.array([finding(of, "temperature_bias").parameters[f"c_{a}"].value for a in "xyz"])  # type: ignore[arg-type]

    error = finding(before, "temperature_bias").parameters["c_x"].stderr
    assert c(result) == pytest.approx(rotation @ c(before), abs=0.1 * error)
    for name, p in finding(before, "rail_curvature").parameters.items():  # the rail's own axes do not turn
        assert finding(result, "rail_curvature").parameters[name].value == pytest.approx(p.value, abs=0.1 * p.stderr)
    assert result.rate_rms.full == pytest.approx(before.rate_rms.full, rel=1e-3)


def test_origin_of_time_and_order_of_runs() -> None:
    session = made(BOW, base=replace(BASE, start_s=86_400.0 * 300))
    shuffled = replace(
        session, runs=tuple(session.runs[i] for i in np.random.default_rng(1).permutation(len(session.runs)))
    )
    result, before = analyse(shuffled, SETTINGS), analysed(BOW)
    assert (result.verdict, names(result)) == (before.verdict, names(before))
    for name, p in finding(before, "rail_curvature").parameters.items():
        assert finding(result, "rail_curvature").parameters[name].value == pytest.approx(p.value, abs=0.05 * p.stderr)
    assert result.rate_rms.full == pytest.approx(before.rate_rms.full, rel=1e-3)


def test_lost_samples() -> None:
    lossy = replace(BASE, chain=replace(BASE.chain, loss=0.02))
    result = analysed(BOW, base=lossy)
    assert (result.verdict, names(result)) == ("effects_found", ["rail_curvature", "sample_loss"]), result.unexplained
    session = made(BOW, base=lossy)
    lost = {run.name: run.link.lost for run, _ in session.runs if run.link}
    assert sum(lost.values()) > 50
    for summary in result.runs:
        assert summary.lost == lost[summary.bag.rsplit("/", 1)[-1]]


def test_without_temperature_it_says_so() -> None:
    result = analysed(TEMPERATURE, base=replace(BASE, temperature_topic=False))
    assert "temperature_bias" not in names(result)
    assert any("temperature_bias" in line for line in result.undecided), result.undecided
    assert result.verdict != "effects_found", names(result)


def test_without_held_out_runs_each_is_held_out_in_turn() -> None:
    def fitted(run: Run, _role: str) -> tuple[Run, str]:
        return run, "fit"

    result, before = analyse(changed(made(BOW), fitted), SETTINGS), analysed(BOW)
    assert (result.verdict, names(result)) == ("effects_found", ["rail_curvature"])
    assert result.rate_rms.full == pytest.approx(before.rate_rms.full, rel=0.3)
    assert result.rate_rms.full < 0.9 * result.rate_rms.declared


@pytest.mark.parametrize(("late_s", "fast"), [(0.05, 0.0), (0.0, 50e-6)])
def test_clocks_of_two_computers(late_s: float, fast: float) -> None:
    """A constant offset is the encoder's delay; a crystal that is 50 ppm fast makes one delay a run, and is said."""
    session = made(BOW)
    origin = min(int(run.imu.stamp_ns[0]) for run, _ in session.runs)

    def shifted(run: Run, role: object) -> tuple[Run, object]:
        assert run.pose is not None
        stamps = run.pose.stamp_ns - np.rint(late_s * 1e9 + fast * (run.pose.stamp_ns - origin)).astype(np.int64)
        return replace(run, pose=replace(run.pose, stamp_ns=stamps)), role

    result, before = analyse(changed(session, shifted), SETTINGS), analysed(BOW)
    assert (result.verdict, names(result)) == (before.verdict, names(before)), result.unexplained
    assert result.rate_rms.full == pytest.approx(before.rate_rms.full, rel=0.03)
    assert any("two clocks" in note for note in result.notes) == (fast > 0)


def _one_axis(run: Run, *, beside: bool) -> Run:
    """The run as a LISY300 would have recorded it, another IMU of its board beside it or not."""
    imu = replace(
        run.imu,
        angular_rate=run.imu.angular_rate * [0.0, 0.0, 1.0],
        specific_force=np.full_like(run.imu.specific_force, np.nan),
        rate_axes=(False, False, True),
    )
    return replace(run, imu=imu, beside=run.imu if beside else None)


@pytest.mark.parametrize("beside", [True, False])
def test_a_gyro_without_accelerometer(*, beside: bool) -> None:
    result = analyse(changed(made(), lambda run, role: (_one_axis(run, beside=beside), role)), SETTINGS)
    assert (result.verdict, names(result)) == ("nothing_missing", []), result.unexplained
    assert result.declared_parameters["g_sensitivity"]["g_zx"].significant
    assert any("no accelerometer" in line for line in result.undecided) != beside
