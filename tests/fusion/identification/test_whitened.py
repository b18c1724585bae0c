"""Grams by series and spread against the columns themselves, whitened one by one."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.analysis import Settings
from gsense_fusion.identification.campaign import build_campaign
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates, per_axis
from gsense_fusion.identification.effects.design import Mixed
from gsense_fusion.identification.engine import decidable
from gsense_fusion.identification.likelihood.bins import window_bins
from gsense_fusion.identification.likelihood.model import Likelihood
from gsense_fusion.identification.likelihood.store import design
from gsense_fusion.identification.likelihood.whitened import project_out_slow, whiten
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.noise.rest import noise_at_rest
from gsense_fusion.identification.recording.integrity import clean_runs
from gsense_fusion.identification.types import Role

from .sessions import BOW, made

MODEL = ("g_sensitivity", "temperature_bias", "rail_curvature", "g_resonance", "time_offset", "friction_pickup")
TEMPLATES = Templates((("gyro_delay_s", 0.013), ("resonance_hz", 7.3), ("temperature_lag_s", 4.0)))


@pytest.fixture(scope="module")
def likelihood() -> Likelihood:
    campaign = build_campaign(clean_runs([(run, Role(role)) for run, role in made(BOW).runs]))
    noise, _ = noise_at_rest(campaign)
    source = DriverSource(campaign, Response.of(noise))
    catalogue = tuple(e for e in Settings("mpu6050").catalogue if e.name in MODEL)
    effects, _ = decidable(catalogue, campaign, source)
    return Likelihood(campaign, source, effects, noise)


@pytest.mark.parametrize("templates", [Templates(), TEMPLATES], ids=["default", "searched"])
def test_grams_are_those_of_the_whitened_columns(likelihood: Likelihood, templates: Templates) -> None:
    assert {e.name for e in likelihood.effects} == set(MODEL)
    for gram, data in zip(likelihood.fast.grams(templates, frozenset(MODEL)), likelihood.campaign.fit, strict=True):
        X = design(likelihood.effects, likelihood.source, data, templates)
        both = np.concatenate([X, data.run.angular_rate[:, :, None]], axis=2)
        full = np.zeros((both.shape[2],) * 2)
        for window in (w for w in data.windows if w.moving):
            bins = window_bins(len(window), data.run.rate_hz, likelihood.noise)
            rows = project_out_slow(whiten(both[window.start : window.stop], bins), bins).reshape(-1, both.shape[2])
            full += rows.T @ rows
        size = np.sqrt(np.maximum(np.diag(full), 1e-12))
        unit = full / np.outer(size, size)
        np.testing.assert_allclose(gram.xx / np.outer(size[:-1], size[:-1]), unit[:-1, :-1], atol=1e-9)
        np.testing.assert_allclose(gram.xy / size[:-1] / size[-1], unit[:-1, -1], atol=1e-9)
        assert gram.yy == pytest.approx(full[-1, -1], rel=1e-12)


def test_block_means_are_means_of_the_columns(likelihood: Likelihood) -> None:
    found = likelihood.block_columns(TEMPLATES)
    for row, (number, window) in zip(found, likelihood.cuts, strict=True):
        data = likelihood.campaign.fit[number]
        X = design(likelihood.effects, likelihood.source, data, TEMPLATES)
        np.testing.assert_allclose(row, X[window.start : window.stop].mean(axis=0), rtol=1e-9, atol=1e-9)


def test_a_design_is_the_same_as_array_and_as_series() -> None:
    rng = np.random.default_rng(1)
    mixed = Mixed.beside([per_axis(rng.normal(size=50)), per_axis(rng.normal(size=50))])
    columns, beta = np.asarray(mixed), rng.normal(size=6)
    assert columns.shape == (50, 3, 6)
    np.testing.assert_allclose(mixed @ beta, columns @ beta, atol=1e-14)
    np.testing.assert_allclose(np.asarray(Mixed.of(columns)), columns, atol=1e-14)


def test_every_effect_has_as_many_columns_as_parameters(likelihood: Likelihood) -> None:
    data = likelihood.campaign.fit[0]
    drivers = likelihood.source.of(data, Templates())
    effect: Effect
    for effect in likelihood.effects:
        assert np.asarray(effect.design(drivers)).shape == (len(data.run), 3, len(effect.parameters))
