"""What is there is found, what is not there is not, on sessions whose physics the engine does not share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.study.judge import analyse, deviations
from tests.study.reference import held_out_rms, true_noise
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG, ChainParameters

from gsense_fusion.bags.run import Run, ScalarSeries
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.engine import Settings
from gsense_fusion.identification.types import Owner

from .sessions import BASE, BOW, LATE, SETTINGS, TEMPERATURE, analysed, changed, finding, made, names

BRUSHES = Disturbance("brush_current", 0.02 * DEG)

WIDE = 2 * 1.96
"""Twice the 95 % interval."""


def _complete(*disturbances: Disturbance) -> None:
    """Held out, the full model leaves the noise that was really there, and says so."""
    result, session = analysed(*disturbances), made(*disturbances)
    realised = held_out_rms(session, true_noise(session))
    assert result.rate_rms.full < 1.05 * realised
    assert result.rate_rms.noise_floor == pytest.approx(realised, rel=0.3)
    assert result.rate_rms.full <= result.rate_rms.declared <= result.rate_rms.raw
    removable = result.rate_rms.declared**2 - realised**2
    assert removable > 0
    assert result.rate_rms.full**2 - realised**2 < 0.1 * removable
    z = deviations(session, result)
    assert z
    assert max(map(abs, z.values())) < WIDE, z


def test_null_with_warm_up_at_200_hz() -> None:
    base = replace(BASE, seed=12, chain=ChainParameters(rate_hz=200.0))
    result = analysed(base=base)
    assert result.verdict == "nothing_missing", (names(result), result.unexplained)
    assert result.unexplained is None
    assert result.rate_rms.full == result.rate_rms.declared < result.rate_rms.raw


def test_a_supply_that_hardly_moves_is_no_finding() -> None:
    """Columns that cost less than others must not make a model cheaper where they say nothing."""

    def with_battery(run: Run, role: str) -> tuple[Run, str]:
        stamps = run.imu.stamp_ns[:: len(run.imu) // 12]
        volts = 3.9 - 1e-4 * np.arange(len(stamps))
        return replace(run, battery=ScalarSeries(stamps, volts)), role

    result = analyse(changed(made(), with_battery), SETTINGS)
    assert result.verdict == "nothing_missing", (names(result), result.unexplained)


@pytest.mark.parametrize(
    ("disturbance", "owner"),
    [(TEMPERATURE, Owner.SENSOR), (BOW, Owner.RIG), (LATE, Owner.CHAIN)],
    ids=lambda x: getattr(x, "kind", ""),
)
def test_single_effect(disturbance: Disturbance, owner: Owner) -> None:
    result = analysed(disturbance)
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == [disturbance.kind]
    found = finding(result, disturbance.kind)
    assert found.owner is owner
    assert found.p_value < 1e-6
    assert found.rate_rms_after < found.rate_rms_before
    _complete(disturbance)


def test_axes_are_those_that_the_effect_reaches() -> None:
    session, result = made(TEMPERATURE), analysed(TEMPERATURE)
    size = np.abs(session.direction * TEMPERATURE.size)
    assert "xyz"[int(np.argmax(size))] in finding(result, "temperature_bias").axes
    for i, parameter in enumerate(("c_x", "c_y", "c_z")):
        p = finding(result, "temperature_bias").parameters[parameter]
        if size[i] > 6 * p.stderr:
            assert "xyz"[i] in finding(result, "temperature_bias").axes


def test_pair() -> None:
    result = analysed(TEMPERATURE, BOW)
    assert result.verdict == "effects_found", result.unexplained
    assert names(result) == ["rail_curvature", "temperature_bias"]
    _complete(TEMPERATURE, BOW)


OUTSIDE = [(Disturbance("power_drawn", 0.05 * DEG), 16.0)]


@pytest.mark.parametrize(("disturbance", "frequency"), OUTSIDE, ids=[d.kind for d, _ in OUTSIDE])
def test_outside_the_catalogue_is_unexplained(disturbance: Disturbance, frequency: float) -> None:
    """Frequency: rad/s that must be among those named (second order of the fastest drive)."""
    result = analysed(disturbance)
    assert result.verdict == "unexplained", (result.verdict, names(result))
    assert names(result) == []
    assert result.unexplained is not None
    assert any(abs(f - frequency) < 0.02 * frequency for f in result.unexplained.frequencies), result.unexplained
    assert result.unexplained.rate_rms > 0
    # named axes are those that the mechanism reaches
    reach = np.abs(made(disturbance).direction)
    assert "xyz"[int(np.argmax(reach))] in result.unexplained.axes


LIKE_A_DELAY = ("jerk_coupling", "belt_tilt", "g_resonance")
"""To first order a delay of G f is the jerk: without it in the catalogue these take its place, and rightly so."""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("removed", "with_it"), [(BOW, ("speed_pickup",)), (LATE, LIKE_A_DELAY)], ids=["rail_curvature", "time_offset"]
)
def test_an_effect_taken_out_of_the_catalogue_is_unexplained(removed: Disturbance, with_it: tuple[str, ...]) -> None:
    """Taken out with it is what no run of this plan can tell from it."""
    catalogue = tuple(e for e in CATALOGUE if not {e.name, e.part_of} & {removed.kind, *with_it})
    result = analyse(made(removed), Settings("mpu6050", catalogue=catalogue))
    assert result.verdict == "unexplained", (result.verdict, names(result))
    assert removed.kind not in names(result)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("disturbance", "effect"),
    [
        (Disturbance("rectification", 0.15 * DEG / 9.80665**2), "g_squared"),
        (Disturbance("hard_spring", 0.3 * DEG), "g_cubed"),
        (BRUSHES, "friction_pickup"),
        (Disturbance("bias_jump", 0.1 * DEG), "bias_jump"),
        (Disturbance("supply", 3.0 * DEG), "supply_voltage"),
        (Disturbance("bearing_play", 0.003 * DEG), "reversal_rock"),
        (Disturbance("belt_lever", 0.003 * DEG), "belt_tilt"),
        (Disturbance("motion_tone", 0.02 * DEG), "line_tone"),
        (Disturbance("speed_noise", 0.02 * DEG), "speed_noise"),
    ],
    ids=lambda x: getattr(x, "kind", ""),
)
def test_each_mechanism_has_its_name(disturbance: Disturbance, effect: str) -> None:
    result = analysed(disturbance)
    assert result.verdict == "effects_found", (result.unexplained, names(result))
    assert names(result) == [effect]


@pytest.mark.slow
def test_the_current_of_friction_takes_no_share_of_g() -> None:
    """In one mounting the current of inertia is G's twin: it is left out, not given half of it."""
    session = made(BRUSHES)
    declared = analysed(BRUSHES).declared_parameters["g_sensitivity"]
    measured = np.array([[declared[f"g_{r}{c}"].value for c in "xyz"] for r in "xyz"])
    along = session.sensor_from_carriage[:, 0]
    assert measured @ along == pytest.approx(session.g_matrix @ along, abs=0.01 * DEG / 9.80665)
    assert any(p.significant for p in declared.values())


@pytest.mark.slow
def test_a_tone_on_an_order_of_one_run_is_not_locked_to_its_drive() -> None:
    frequency = 8.5 * 3.5 / (2 * np.pi) + 0.05  # at order 8.5 of the run at 3.5 rad/s
    size = np.array([0.02, -0.01, 0.0]) * DEG

    def hum(run: Run, role: str) -> tuple[Run, str]:
        if run.encoder is None or np.ptp(run.encoder.position) < 1e-3:
            return run, role
        moving = run.encoder.stamp_ns[np.abs(run.encoder.position - run.encoder.position[0]) > 1e-3]
        on = (run.imu.stamp_ns > moving[0]) & (run.imu.stamp_ns < moving[-1])
        phase = 2 * np.pi * frequency * 1e-9 * (run.imu.stamp_ns - run.imu.stamp_ns[0])
        tone = (on * np.sin(phase))[:, None] * size
        return replace(run, imu=replace(run.imu, angular_rate=run.imu.angular_rate + tone)), role

    result = analyse(changed(made(), hum), SETTINGS)
    assert names(result) == ["line_tone"], result.unexplained
    assert result.verdict == "effects_found", result.unexplained
    found = finding(result, "line_tone")
    assert found.axes == ("x", "y")
    assert found.parameters["frequency"].value == pytest.approx(frequency, abs=0.02)
    for axis, true in zip("xyz", np.abs(size), strict=True):
        assert abs(found.parameters[f"a_{axis}"].value) == pytest.approx(true, abs=0.003 * DEG)


def test_undeclared_g_sensitivity_is_found() -> None:
    result = analyse(made(), Settings("mpu6050", declared=("bias",)))
    assert names(result) == ["g_sensitivity"], result.unexplained
    along = made().sensor_from_carriage[:, 0]
    measured = np.array(
        [[finding(result, "g_sensitivity").parameters[f"g_{r}{c}"].value for c in "xyz"] for r in "xyz"]
    )
    # one mounting identifies the column along the rail (and gravity's, which hides in the bias, is not identified)
    assert measured @ along == pytest.approx(made().g_matrix @ along, abs=0.01 * DEG / 9.80665)
    assert result.rate_rms.declared == result.rate_rms.raw
