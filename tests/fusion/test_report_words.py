"""The sentence and the units: right words with the right numbers."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import pytest
from tests.fusion import report_results as made

from gsense_fusion.identification.errors.metrics import Rms
from gsense_fusion.identification.types import Owner, Parameter
from gsense_fusion.report.units import engineers, interval, number, probability, together
from gsense_fusion.report.words import CORRECTIONS, TIMING, correction, grouped, one_sentence, separating_run

ENDING = "the rate error below 5 Hz"


def test_effects_found() -> None:
    assert one_sentence(made.effects_found()) == (
        "mpu6050: the declared model lacks rail_curvature (rig; t_y = 0.130 +- 0.004 deg/m, p < 1e-12) or "
        f"speed_pickup: on runs it had not seen, {ENDING} "
        "falls from 0.0372 to 0.0205 deg/s, the noise floor being 0.0200."
    )


def test_two_effects_with_a_delay_in_milliseconds() -> None:
    result = replace(made.effects_found(), findings=(replace(made.rail(), alternatives=()), made.delay()))
    assert "0.004 deg/m, p < 1e-12) and time_offset (chain; tau = 20.0 +- 0.5 ms, p = 3e-05): on runs" in one_sentence(
        result
    )


def test_nothing_missing() -> None:
    assert one_sentence(made.nothing_missing()) == (
        "mpu6050: nothing is missing from the declared model (bias, g_sensitivity): on runs it had not seen, "
        f"{ENDING} is 0.0205 deg/s (0.0467 with the bias alone), the noise floor being 0.0200."
    )


def test_unexplained_alone_and_beside_a_finding() -> None:
    what = "something is there that no effect of the catalogue explains "
    what += "(0.022 deg/s on x, y, strongest at 2.00 Hz; nearest is"
    assert one_sentence(made.only_unexplained()).startswith(
        f"mpu6050: {what} g_cubed): on runs it had not seen, {ENDING} is"
    )
    both = one_sentence(made.partly_unexplained())
    assert (
        f"lacks rail_curvature (rig; t_y = 0.130 +- 0.004 deg/m, p < 1e-12) or speed_pickup, and beyond that {what}"
        in both
    )
    assert "falls from 0.0372 to 0.0205 deg/s" in both


def test_still_poses_are_judged_by_their_means() -> None:
    assert one_sentence(made.still_poses()).endswith(
        "on each part left out in turn, the error of the mean rate at rest falls from 0.0701 to 0.0221 deg/s, "
        "the noise floor being 0.0151."
    )


def test_unit_and_data_held_out_in_turn_are_named() -> None:
    result = made.effects_found()
    result = replace(result, unit_id="unit-7", runs=tuple(replace(r, role="fit") for r in result.runs))
    assert one_sentence(result).startswith("mpu6050 unit-7: ")
    assert "on each run left out in turn" in one_sentence(result)


@pytest.mark.parametrize(("full", "verb"), [(0.05, "rises from 0.0372 to 0.0500"), (0.0371, "stays")])
def test_an_error_that_does_not_fall_is_not_said_to(full: float, verb: str) -> None:
    rate = Rms(0.0467 * made.RAD, 0.0372 * made.RAD, full * made.RAD, 0.02 * made.RAD)
    text = one_sentence(replace(made.effects_found(), rate_rms=rate))
    assert verb in text
    assert "falls" not in text


@pytest.mark.parametrize("name", made.ALL)
def test_one_ascii_line(name: str) -> None:
    text = one_sentence(made.ALL[name]())
    assert text.isascii()
    assert "\n" not in text
    assert text.endswith(".")


def test_every_owner_has_a_correction_and_a_delay_is_a_matter_of_timing() -> None:
    assert set(CORRECTIONS) == set(Owner)
    assert correction(made.delay()) == TIMING
    assert "not the gyro" in correction(made.rail())
    assert "180 degrees" in separating_run("board_turned_180")
    assert separating_run("some_new_run") == "some new run"


@pytest.mark.parametrize(
    ("unit", "factor", "name"),
    [
        ("rad/s", 180 / pi, "deg/s"),
        ("(rad/s)/(m/s^2)", 180 / pi * 9.80665, "deg/s/g"),
        ("(rad/s)/(m/s^2)^2", 180 / pi * 9.80665**2, "deg/s/g^2"),
        ("(rad/s)/(m/s^2)^3", 180 / pi * 9.80665**3, "deg/s/g^3"),
        ("(rad/s)/(m/s^3)", 180 / pi, "deg/s/(m/s^3)"),
        ("(rad/s)/(m/s)", 180 / pi, "deg/s/(m/s)"),
        ("rad/s/K", 180 / pi, "deg/s/K"),
        ("rad/s/V", 180 / pi, "deg/s/V"),
        ("rad/s/sqrt(s)", 180 / pi, "deg/s/sqrt(s)"),
        ("rad/m", 180 / pi, "deg/m"),
        ("rad/m^2", 180 / pi, "deg/m^2"),
        ("rad/(m/s^2)", 180 / pi, "deg/(m/s^2)"),
        ("rad", 180 / pi, "deg"),
        ("s", 1e3, "ms"),
        ("m", 1e3, "mm"),
        ("Hz", 1.0, "Hz"),
        ("", 1.0, ""),
    ],
)
def test_units_of_the_catalogue(unit: str, factor: float, name: str) -> None:
    scale = engineers(unit)
    assert scale.factor == pytest.approx(factor, rel=1e-12)
    assert scale.unit == name


def test_long_times_stay_in_seconds() -> None:
    assert engineers("s", "lag_s").unit == "s"
    assert engineers("s", "t0").unit == "s"


def test_numbers() -> None:
    assert number(0.0) == "0"
    assert number(1234.5) == "1230"
    assert number(0.020512) == "0.0205"
    assert number(3.2e-9) == "3.20e-09"
    assert number(float("inf")) == "unbounded"
    assert number(float("nan")) == "unknown"
    assert together(0.0467, 0.0205, 0.02) == ["0.0467", "0.0205", "0.0200"]
    assert together(12.0, 0.0204) == ["12.000", "0.020"]  # at most two decimals more than the largest deserves
    assert together(0.0, 0.0) == ["0", "0"]
    assert probability(0.0) == "p < 1e-12"
    assert probability(2.3e-5) == "p = 2e-05"
    assert probability(0.25) == "p = 0.25"


def test_intervals() -> None:
    assert interval(Parameter(1e-4, 1e-6, "(rad/s)/(m/s^2)")) == "0.0562 +- 0.0011 deg/s/g"
    assert interval(Parameter(-1e-9, 1e-6, "rad/s"), si=True) == "(-0.0 +- 2.0)e-06 rad/s"
    assert interval(Parameter(0.004, 1e-5, "rad/m"), si=True) == "0.004000 +- 0.000020 rad/m"
    assert interval(Parameter(0.02, 0.0, "s")) == "20.0 ms"
    assert interval(Parameter(0.02, float("inf"), "s")) == "20.0 +- unbounded ms"


def test_what_could_not_be_decided_for_the_same_reason_stands_in_one_line() -> None:
    lines = ("g_cubed could not be decided: no motion", "turn the board", "belt_tilt could not be decided: no motion")
    assert grouped(lines) == ["g_cubed, belt_tilt could not be decided: no motion", "turn the board"]


def test_a_magnetic_finding_is_quoted_by_what_it_does_to_the_heading() -> None:
    parameters = {"d_x": Parameter(-5.2e-6, 4e-8, "T"), "heading": Parameter(0.1508, 0.0016, "rad")}
    finding = replace(made.rail(), effect="mag_position", parameters=parameters)
    sentence = one_sentence(replace(made.effects_found(), findings=(finding,)))
    assert "heading = 8.64 +- 0.18 deg" in sentence
    assert "the heading suffers, the gyro does not" in sentence
    assert "uT" in interval(parameters["d_x"], "d_x")
