"""What changed between two reports: nothing where nothing did, by numbers; and what did, by name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.fusion import report_results as made
from tests.fusion.comparison.reports import (
    PLAUSIBLE,
    PRECISION,
    RNG,
    TRUE_G,
    along,
    one_mounting,
    result,
    shot,
    with_rail,
)

from gsense_fusion.comparison.changes import FALSE_ALARM, Comparison, Status
from gsense_fusion.comparison.contrast import contrast
from gsense_fusion.comparison.differences import compare
from gsense_fusion.comparison.page import comparison_html
from gsense_fusion.comparison.words import badge, one_sentence
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import IdentificationError, Parameter

CYCLIC = np.roll(np.eye(3), 1, axis=1)


def statuses(c: Comparison) -> dict[str, Status]:
    return {e.effect: e.status for e in c.effects}


def test_nothing_changed_is_said_with_its_numbers() -> None:
    c = compare(shot(result(1)), shot(result(2)))
    assert c.verdict == "nothing_changed"
    assert statuses(c) == {"g_sensitivity": Status.SAME, "bias": Status.SESSION}
    assert c.k is not None
    assert abs(c.k.difference.value) < 5 * PRECISION
    text = one_sentence(c)
    assert text.startswith("mpu6050 A17: nothing changed (k differs by ")
    assert "chi2 = " in text


def test_false_alarms_are_as_rare_as_said_for_mountings_that_repeat_to_degrees() -> None:
    """Sessions drawn from the reports' own errors: G's other columns are the same unknown in both."""
    alarms, count = 0, 500
    for seed in range(count):
        r = RNG([seed, 5])
        g = PLAUSIBLE * r.standard_normal((3, 3))
        a, b = (shot(result(2 * seed + i, g, float(r.normal(0, 0.05)))) for i in (0, 1))
        alarms += compare(a, b).verdict == "changed"
    assert alarms <= FALSE_ALARM * count + 3 * np.sqrt(FALSE_ALARM * count)


def test_the_distance_is_a_chi_square() -> None:
    found = []
    for seed in range(500):
        g = PLAUSIBLE * RNG([seed, 6]).standard_normal((3, 3))
        (old, before), (new, after) = one_mounting(2 * seed, g, 0.02), one_mounting(2 * seed + 1, g, -0.03)
        found.append(contrast(old, new, before, after))
    assert {c.dof for c in found} == {3}
    assert np.mean([c.statistic for c in found]) == pytest.approx(3.0, abs=0.3)
    assert np.mean([c.p_value < 0.05 for c in found]) == pytest.approx(0.05, abs=0.025)
    # the elements' own errors say the same
    z = [c.difference[[0, 3, 6]] / c.stderr[[0, 3, 6]] for c in found]
    assert np.std(z) == pytest.approx(1.0, abs=0.08)


@pytest.mark.parametrize("sigmas", [5.0, -8.0])
def test_a_drift_of_k_by_five_standard_errors_is_said(sigmas: float) -> None:
    drift = sigmas * np.sqrt(2) * PRECISION
    said = 0
    for seed in range(30):
        c = compare(shot(result(seed)), shot(result(seed + 500, TRUE_G + drift * CYCLIC)))
        said += statuses(c)["g_sensitivity"] is Status.DRIFTED
        if statuses(c)["g_sensitivity"] is Status.DRIFTED:
            assert c.k is not None
            assert c.k.difference.value == pytest.approx(drift, abs=4 * np.sqrt(2) * PRECISION)
            assert "g_sensitivity drifted: k went from" in one_sentence(c)
    assert said >= 27  # power of 5 standard errors against the threshold of about 3


def test_two_units_differ_and_have_not_drifted() -> None:
    other = result(2, TRUE_G + 30.0 * PRECISION * CYCLIC)
    c = compare(shot(result(1)), shot(replace(other, unit_id="B03")))
    assert "g_sensitivity differs: k goes from" in one_sentence(c)
    assert badge(c) == "the units differ"
    c = compare(shot(result(1)), shot(replace(with_rail(2), unit_id="B03")))
    assert "rail_curvature (rig) is in NEW only with t_y" in one_sentence(c)
    assert not any(word in comparison_html(c) for word in (": drifted", ": entered"))


def test_other_columns_of_g_say_nothing_of_each_other() -> None:
    old, new = result(1), result(2, angle=np.pi / 2)
    c = compare(shot(old), shot(new))
    assert c.verdict == "nothing_changed"
    assert not any(d.identified for e in c.effects if e.effect == "g_sensitivity" for d in e.parameters)


def _expecting(r: LoopResult, angle: float) -> LoopResult:
    """The report with most of G's other columns in its values, still as unsure of them."""
    rest = 0.9 * TRUE_G @ (np.eye(3) - np.outer(along(angle), along(angle)))
    g = r.declared_parameters["g_sensitivity"]
    values = {n: replace(p, value=p.value + float(x)) for (n, p), x in zip(g.items(), rest.ravel(), strict=True)}
    return replace(r, declared_parameters={**r.declared_parameters, "g_sensitivity": values})


def test_what_a_report_expects_of_columns_that_it_does_not_identify_is_no_difference() -> None:
    old, new = result(1, angle=0.03), result(2, angle=-0.05)
    plain, c = (compare(shot(old), shot(n)) for n in (new, _expecting(new, -0.05)))
    assert c.verdict == "nothing_changed"
    assert c.k is not None
    assert plain.k is not None
    assert c.k.difference.value == pytest.approx(plain.k.difference.value)
    (mine,), (theirs,) = ([e for e in x.effects if e.effect == "g_sensitivity"] for x in (c, plain))
    assert mine.p_value == pytest.approx(theirs.p_value)
    assert [d.z for d in mine.parameters] == pytest.approx([d.z for d in theirs.parameters], nan_ok=True)


def test_an_effect_that_entered_or_is_gone_is_named_with_its_owner() -> None:
    c = compare(shot(result(1)), shot(with_rail(2)))
    assert statuses(c)["rail_curvature"] is Status.ENTERED
    assert "rail_curvature (rig) entered with t_y = 0.1318 +- 0.0034 deg/m" in one_sentence(c)
    assert statuses(compare(shot(with_rail(2)), shot(result(1))))["rail_curvature"] is Status.GONE


def test_an_effect_that_the_other_report_does_not_exclude_is_no_change() -> None:
    c = compare(shot(result(1)), shot(with_rail(2, t_y=1e-4)))
    assert statuses(c)["rail_curvature"] is Status.UNSURE
    assert c.verdict == "nothing_changed"
    assert "OLD does not exclude it" in one_sentence(c)


def test_an_effect_that_the_other_could_not_decide_is_no_change() -> None:
    blind = replace(result(1), not_found={}, undecided=("rail_curvature could not be decided: no motion",))
    c = compare(shot(blind), shot(with_rail(2)))
    assert statuses(c)["rail_curvature"] is Status.UNSURE
    assert "OLD could not decide it" in one_sentence(c)


def test_parameters_of_an_effect_in_both_drift_or_not() -> None:
    assert statuses(compare(shot(with_rail(1)), shot(with_rail(2, 2.32e-3))))["rail_curvature"] is Status.SAME
    c = compare(shot(with_rail(1)), shot(with_rail(2, 3e-3)))
    assert statuses(c)["rail_curvature"] is Status.DRIFTED
    assert "t_y by 0.040" in one_sentence(c)


def test_rivals_that_a_later_report_tells_apart_are_settled_not_changed() -> None:
    pickup = replace(with_rail(2).findings[0], effect="speed_pickup", alternatives=())
    new = replace(with_rail(2), findings=(pickup,), not_found={})
    c = compare(shot(with_rail(1, alternatives=("speed_pickup",))), shot(new))
    assert statuses(c)["speed_pickup"] is Status.SETTLED
    assert "rail_curvature" not in statuses(c)
    assert c.verdict == "nothing_changed"
    assert "speed_pickup is now named (rail_curvature or a rival of it in OLD)" in one_sentence(c)


def test_noise_and_delay_count_where_they_are_sure_and_large_enough() -> None:
    old, new = result(1), result(2)
    louder = {x: replace(p, value=1.2 * p.value) for x, p in new.rest_noise.items()}
    c = compare(shot(old), shot(replace(new, rest_noise=louder, encoder_delay=Parameter(8e-3, 5e-5, "s"))))
    assert [s.name for s in c.changed_scalars] == ["noise x", "noise y", "noise z", "delay of the IMU"]
    assert "delay of the IMU went from 5." in one_sentence(c)
    sure = replace(new, encoder_delay=replace(old.encoder_delay, value=5.2e-3, stderr=1e-7))  # type: ignore[type-var]
    assert compare(shot(old), shot(sure)).verdict == "nothing_changed"


def test_something_unexplained_that_entered() -> None:
    c = compare(shot(result(1)), shot(replace(result(2), unexplained=made.unexplained())))
    assert c.verdict == "changed"
    assert "something unexplained entered (locked to the drive at order 2)" in one_sentence(c)


def test_other_sensors_are_refused_and_other_units_and_models_warned_of() -> None:
    with pytest.raises(IdentificationError, match=r"new\.json: is of the sensor bno055, old\.json of mpu6050"):
        compare(shot(result(1), "old.json"), shot(replace(result(2), sensor="bno055"), "new.json"))
    c = compare(shot(result(1)), shot(replace(result(2), unit_id="B03", declared=("bias",))))
    assert "two units (A17, B03)" in c.warnings[0]
    assert "declared differently: OLD bias, g_sensitivity; NEW bias" in c.warnings[1]
    assert one_sentence(c).startswith("mpu6050, units A17 (OLD) and B03 (NEW): no difference")
    assert badge(c) == "the units agree"
    assert "does not name its unit" in compare(shot(result(1)), shot(result(2, unit_id=None))).warnings[0]
    assert "4 bags are in both" in compare(shot(result(1)), shot(result(1))).warnings[0]


def test_declared_in_one_and_found_in_the_other_is_the_same_effect() -> None:
    old, new = result(1), result(2)
    parameters = new.declared_parameters["g_sensitivity"]
    found = replace(made.rail(), effect="g_sensitivity", parameters=parameters, alternatives=())
    new = replace(
        new, declared=("bias",), declared_parameters={"bias": new.declared_parameters["bias"]}, findings=(found,)
    )
    assert statuses(compare(shot(old), shot(new)))["g_sensitivity"] is Status.SAME


def test_a_report_without_covariances_is_compared_element_by_element() -> None:
    old = replace(result(1), covariances={})
    c = compare(shot(old), shot(result(2)))
    assert c.verdict == "nothing_changed"
    assert any("earlier version" in w for w in c.warnings)
    assert c.effects[-2].chi2 is None
    far = result(2, TRUE_G + 40 * PRECISION * np.eye(3))
    assert compare(shot(old), shot(far)).verdict == "changed"
