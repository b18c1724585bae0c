"""An effect has one size in every run; what only resembles it follows the speed."""

from __future__ import annotations

from dataclasses import replace

import pytest
from tests.study.simulator import Disturbance
from tests.study.simulator.parameters import DEG

from gsense_fusion.identification.campaign import build_campaign
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Templates
from gsense_fusion.identification.effects.g_sensitivity import GSensitivity
from gsense_fusion.identification.effects.speed_pickup import SpeedPickup
from gsense_fusion.identification.likelihood.model import Likelihood
from gsense_fusion.identification.noise.rest import noise_at_rest
from gsense_fusion.identification.recording.integrity import clean_runs
from gsense_fusion.identification.types import Role
from gsense_fusion.identification.verdict.homogeneity import Homogeneity, Trend, homogeneity

from .sessions import made


def _of_speed_pickup(kind: str, size: float) -> Homogeneity:
    campaign = build_campaign(clean_runs([(run, Role(role)) for run, role in made(Disturbance(kind, size)).runs]))
    effects = (GSensitivity(), SpeedPickup())
    likelihood = Likelihood(campaign, DriverSource(campaign), effects, noise_at_rest(campaign)[0])
    fit = likelihood.evaluate(frozenset(e.name for e in effects), Templates())
    return homogeneity(likelihood, fit, effects[1])


@pytest.mark.parametrize("size", [0.01, 0.1])
def test_a_pickup_in_proportion_to_the_speed_holds_in_every_run(size: float) -> None:
    found = _of_speed_pickup("back_emf", size * DEG)
    assert found.energy > 30
    assert found.holds
    assert found.trend is not None
    assert found.trend.holds


def test_a_drag_that_grows_with_the_square_of_the_speed_is_no_pickup() -> None:
    """One degree of freedom sees it where the spread over the runs alone would not."""
    found = _of_speed_pickup("air_drag", 0.03 * DEG)
    assert found.energy > 100
    assert found.trend is not None
    assert found.trend.gain > 20
    assert found.trend.slope > 0.3
    assert not found.holds


def test_a_weak_effect_may_have_a_slope_by_chance() -> None:
    """0.23 with an error of 0.07 and one of 0.01: the second is surely no constant size."""
    assert Trend(slope=-0.23, gain=(0.23 / 0.07) ** 2).holds
    assert not Trend(slope=-0.23, gain=(0.23 / 0.01) ** 2).holds
    assert not Trend(slope=1.0, gain=(1.0 / 0.25) ** 2).holds


def test_coefficients_that_more_than_the_motion_tells_make_a_trend_no_surer() -> None:
    """The block means pull at the size in all runs alike: no trend, however little the motion alone tells of it."""
    campaign = build_campaign(clean_runs([(run, Role(role)) for run, role in made(Disturbance("back_emf", DEG)).runs]))
    effects = (GSensitivity(), SpeedPickup())
    likelihood = Likelihood(campaign, DriverSource(campaign), effects, noise_at_rest(campaign)[0])
    fit = likelihood.evaluate(frozenset(e.name for e in effects), Templates())
    known = replace(fit, covariance=0.25 * fit.covariance)
    found, held = (homogeneity(likelihood, f, effects[1]).trend for f in (fit, known))
    assert found is not None
    assert held is not None
    assert held.slope / found.slope == pytest.approx(held.gain / found.gain)
    assert held.gain < 0.9 * found.gain
