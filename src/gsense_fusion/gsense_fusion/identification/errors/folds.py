"""Which runs judge which model: the held-out ones, or without any each run in turn by models that did not see it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from gsense_fusion.identification.campaign import Campaign, RunData
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.errors.metrics import Held
from gsense_fusion.identification.errors.predict import Prediction, Predictor
from gsense_fusion.identification.likelihood.gram import Columns
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.noise.response import Response
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import Role

MAX_FOLDS = 40


def make_folds(
    campaign: Campaign,
    source: DriverSource,
    effects: tuple[Effect, ...],
    noise: Mapping[int, NoiseModel],
    fits: Mapping[str, Fit],
    progress: Callable[[str], None],
) -> list[Held]:
    """Folds with the models of `fits` (declared, full, and the steps between), raw added.

    Structure, template values and drift stay as found; coefficients are fitted anew without the held-out runs.
    """
    used = tuple(e for e in effects if any(e.name in fit.names for fit in fits.values()))
    fits = {label: _narrowed(fit, effects, used) for label, fit in fits.items()}
    if campaign.held_out:
        models = {label: Prediction.of(label, fit) for label, fit in fits.items()}
        return [Held(campaign.held_out, campaign.runs, _with_raw(models), Predictor(used, source))]
    out = []
    groups = _groups(campaign)
    for number, members in enumerate(groups):
        progress(f"held out in turn {number + 1}/{len(groups)}")
        runs = tuple(_with_role(r, Role.HELD_OUT if r in members else Role.FIT) for r in campaign.runs)
        fold = Campaign(runs, campaign.mountings, campaign.delay)
        fold_source = DriverSource(fold, Response.of(noise, campaign.rate_hz))
        if not fold.fit:
            continue
        likelihood = Likelihood(fold, fold_source, used, noise)
        models = {
            label: Prediction.of(label, likelihood.evaluate(fit.names, fit.templates, fit))
            for label, fit in fits.items()
        }
        out.append(Held(fold.held_out, fold.runs, _with_raw(models), Predictor(used, fold_source)))
    return out


def _narrowed(fit: Fit, effects: tuple[Effect, ...], used: tuple[Effect, ...]) -> Fit:
    """A fit with the columns of some of the effects."""
    keep = Columns.of(effects).index(frozenset(e.name for e in used))
    alignment = {m: delta[keep] for m, delta in fit.alignment.items()}
    covariance = fit.covariance[np.ix_(keep, keep)]
    return replace(fit, beta=fit.beta[keep], expected=fit.expected[keep], covariance=covariance, alignment=alignment)


def _groups(campaign: Campaign) -> list[tuple[RunData, ...]]:
    """One run each; consecutive ones together where there are many."""
    runs = campaign.runs
    count = min(len(runs), MAX_FOLDS)
    return [tuple(runs[i] for i in part) for part in np.array_split(np.arange(len(runs)), count)]


def _with_raw(models: dict[str, Prediction]) -> dict[str, Prediction]:
    some = next(iter(models.values()))
    return {"raw": Prediction("raw", np.zeros_like(some.beta), Templates(), {}), **models}


def _with_role(data: RunData, role: Role) -> RunData:
    return replace(data, run=replace(data.run, role=role))
