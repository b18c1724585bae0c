"""Steel along the rail and the motor's current in the magnetometer, told apart over several speeds."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from tests.study.judge import analyse
from tests.study.simulator import simulate
from tests.study.simulator.magnetics import EARTH, field_at
from tests.study.simulator.parameters import MagneticParameters

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.effects.magnetic import MagMotor, MagPosition
from gsense_fusion.identification.effects.recorded import Recording, Seen, look_at
from gsense_fusion.identification.engine import Settings
from gsense_fusion.identification.recording.clock import on_one_clock
from gsense_fusion.identification.recording.integrity import clean_runs
from gsense_fusion.identification.types import Owner, Role
from gsense_fusion.report.document import report_document
from gsense_fusion.report.figures import figures
from gsense_fusion.report.outputs import compensation

from .sessions import BASE, SETTINGS, SHORT, finding, names

BOTH = frozenset({"mag_position", "mag_motor"})
STEEL = MagneticParameters(steel=0.3)
ONE_SPEED = tuple(replace(r, angular_frequency=5.0) if r.angular_frequency else r for r in SHORT)


@lru_cache(maxsize=16)
def seen(p: MagneticParameters, one_speed: bool = False, known: frozenset[str] = BOTH, seed: int = 11) -> Seen:
    """What the magnetometer of a session shows."""
    plan = ONE_SPEED if one_speed else SHORT
    session = simulate(replace(BASE, seed=seed, plan=plan, magnetics=p))
    clean = clean_runs([(run, Role(role)) for run, role in session.runs])
    campaign, skew = on_one_clock(clean)
    return look_at(Recording(tuple(clean), campaign, skew, known), (MagPosition(), MagMotor()), known)


@pytest.mark.parametrize("seed", [11, 12])
@pytest.mark.parametrize("topic", [False, True])
def test_a_field_that_does_not_change_is_no_finding(seed: int, topic: bool) -> None:
    found = seen(MagneticParameters(current_topic=topic), seed=seed)
    assert not found.readings
    assert not found.unnamed


def test_steel_is_found_with_what_it_does_to_the_heading() -> None:
    found = seen(STEEL)
    assert set(found.readings) == {"mag_position"}
    reading = found.readings["mag_position"]
    assert not reading.alternatives
    s = np.linspace(-0.15, 0.15, 61)
    true = field_at(s, 0 * s, STEEL, 11) - EARTH
    assert reading.curve is not None
    fitted = np.ptp(reading.curve.fitted, axis=0)
    # in the sensor's axes, which the mounting's error tilts by some degrees
    assert np.linalg.norm(fitted) == pytest.approx(np.linalg.norm(np.ptp(true, axis=0)) * 1e6, rel=0.1)
    assert reading.parameters["heading"].value > 20 * reading.parameters["heading"].stderr
    assert 0.02 < reading.parameters["lag_s"].value < 0.06  # half the average of 50 ms, and the polling


@pytest.mark.parametrize("early_s", [0.02, 0.024, 0.045])
def test_strong_steel_that_is_some_milliseconds_off_is_no_motor(early_s: float) -> None:
    """An encoder whose stamps are late makes the magnetometer early; what is left of a lag follows the speed."""
    session = simulate(replace(BASE, seed=11, plan=SHORT, magnetics=MagneticParameters(steel=3.0)))
    runs = []
    for run, role in session.runs:
        assert run.mag is not None
        mag = replace(run.mag, stamp_ns=run.mag.stamp_ns - round(early_s * 1e9))
        runs.append((replace(run, mag=mag), Role(role)))
    clean = clean_runs(runs)
    campaign, skew = on_one_clock(clean)
    found = look_at(Recording(tuple(clean), campaign, skew, BOTH), (MagPosition(), MagMotor()), BOTH)
    assert set(found.readings) == {"mag_position"}
    lag = found.readings["mag_position"].parameters["lag_s"]
    assert abs(lag.value + early_s - 0.035) < 0.012
    assert lag.stderr < 0.002


@pytest.mark.parametrize("topic", [False, True])
def test_the_motors_current_is_found_with_and_without_a_topic_that_tells_it(topic: bool) -> None:
    p = MagneticParameters(turns=6.0, current_topic=topic)
    found = seen(p)
    assert set(found.readings) == {"mag_motor"}
    reading = found.readings["mag_motor"]
    assert not reading.alternatives
    if topic:
        per_ampere = field_at(np.zeros(2), np.array([0.0, 1.0]), p, 11)[1] - EARTH
        measured = np.array([reading.parameters[f"m_{x}"].value for x in "xyz"])
        error = reading.parameters["m_z"].stderr
        assert np.linalg.norm(measured) == pytest.approx(np.linalg.norm(per_ampere), abs=3 * error)


def test_a_motor_that_the_board_comes_nearer_to_is_no_steel() -> None:
    """Its field grows by a quarter on the way to that end."""

    def with_motor(run: Run, role: str) -> tuple[Run, Role]:
        assert run.mag is not None
        assert run.motor_current is not None
        assert run.pose is not None
        stamps = run.mag.stamp_ns
        current = np.interp(stamps, run.motor_current.stamp_ns, run.motor_current.value)
        nearness = 1.0 + 0.25 * np.interp(stamps, run.pose.stamp_ns, run.pose.position) / 0.15
        bent = run.mag.field + (current * nearness)[:, None] * np.array([6e-7, -3e-7, 9e-7])
        return replace(run, mag=replace(run.mag, field=bent)), Role(role)

    session = simulate(replace(BASE, magnetics=MagneticParameters(current_topic=True)))
    clean = clean_runs([with_motor(run, role) for run, role in session.runs])
    campaign, skew = on_one_clock(clean)
    found = look_at(Recording(tuple(clean), campaign, skew, BOTH), (MagPosition(), MagMotor()), BOTH)
    assert set(found.readings) == {"mag_motor"}
    assert found.readings["mag_motor"].parameters["m_z"].value == pytest.approx(9e-7, rel=0.15)


def test_both_at_once() -> None:
    found = seen(MagneticParameters(steel=1.0, turns=6.0, current_topic=True))
    assert set(found.readings) == BOTH


def test_at_one_speed_a_weak_field_of_the_motor_has_steel_for_a_rival() -> None:
    found = seen(MagneticParameters(turns=6.0), one_speed=True)
    (name,) = found.readings
    reading = found.readings[name]
    assert {name, *reading.alternatives} == BOTH
    assert reading.separating_run == "motor_beside_board"


@pytest.mark.parametrize(
    ("p", "left"), [(STEEL, "mag_motor"), (MagneticParameters(turns=20.0), "mag_position")], ids=["steel", "motor"]
)
def test_without_its_name_it_is_unexplained(p: MagneticParameters, left: str) -> None:
    found = seen(p, known=frozenset({left}))
    assert not found.readings
    (unnamed,) = found.unnamed
    assert "follows the carriage" in unnamed.symptom


def test_no_magnetometer_says_nothing() -> None:
    session = simulate(BASE)
    clean = clean_runs([(run, Role(role)) for run, role in session.runs])
    campaign, skew = on_one_clock(clean)
    found = look_at(Recording(tuple(clean), campaign, skew, BOTH), (MagPosition(), MagMotor()), BOTH)
    assert not found.readings
    assert not found.unnamed
    assert not found.undecided


@pytest.mark.slow
def test_in_the_report_it_changes_no_rate_and_compensates_nothing() -> None:
    result = analyse(simulate(replace(BASE, magnetics=STEEL)), SETTINGS)
    assert names(result) == ["mag_position"], result.unexplained
    found = finding(result, "mag_position")
    assert found.owner is Owner.RIG
    assert found.rate_rms_before == found.rate_rms_after
    assert report_document(result)["findings"][0]["parameters"]["heading"]["unit"] == "rad"
    assert not compensation(result).reference
    assert "mag_position" in {f.key for f in figures(result)}


@pytest.mark.slow
def test_without_a_name_the_session_is_unexplained() -> None:
    nameless = tuple(e for e in CATALOGUE if e.name not in BOTH)
    result = analyse(simulate(replace(BASE, magnetics=STEEL)), Settings("mpu6050", catalogue=nameless))
    assert result.verdict == "unexplained"
    assert result.unexplained is not None
    assert "magnetometer" in result.unexplained.description
