"""What a fitted model says of a run, and the residual with one bias a session."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsense_fusion.identification.campaign import RunData
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates, TemplateSpec
from gsense_fusion.identification.kept import kept
from gsense_fusion.identification.likelihood.gram import Columns
from gsense_fusion.identification.likelihood.model import Fit
from gsense_fusion.identification.likelihood.store import predicted
from gsense_fusion.identification.types import BoolArray, FloatArray, Owner

KEPT_RUNS = 64
"""Residuals of the runs that are held out: each error asks for them again."""


@dataclass(frozen=True, eq=False)
class Prediction:
    """A model ready to predict: which columns with which coefficients at which template values."""

    label: str
    beta: FloatArray
    templates: Templates
    alignment: Mapping[int, FloatArray]
    """Difference of the coefficients in each mounting that was fitted."""

    @staticmethod
    def of(label: str, fit: Fit) -> Prediction:
        """From a fit: by what is expected of the directions too that the data does not identify."""
        return Prediction(label, fit.expected, fit.templates, fit.alignment)

    def beta_in(self, mounting: int | None) -> FloatArray:
        """Coefficients in one mounting, shape (P,)."""
        return self.beta if mounting is None or mounting not in self.alignment else self.beta + self.alignment[mounting]


class Predictor:
    """Rates that models predict, bias excluded."""

    def __init__(self, effects: tuple[Effect, ...], source: DriverSource) -> None:
        """Take the catalogue in the order of the coefficients."""
        self._effects = effects
        self._source = source
        self._columns = Columns.of(effects)
        self._biases = kept(None, self._biases_of)
        self._without = kept(KEPT_RUNS, self._without_model)

    def biases(self, runs: tuple[RunData, ...], model: Prediction) -> dict[int, FloatArray]:
        """Bias by session of a model that is asked for more than once, rad/s, shape (3,)."""
        return self._biases(runs, model)

    def _biases_of(self, runs: tuple[RunData, ...], model: Prediction) -> dict[int, FloatArray]:
        return session_biases(runs, {r: self._without_model(r, model) for r in runs})

    def rate(self, data: RunData, model: Prediction, owners: frozenset[Owner] | None = None) -> FloatArray:
        """Predicted angular rate without bias, rad/s, shape (n, 3); only effects of these owners where given."""
        coefficients = model.beta_in(data.mounting_number)
        if owners is not None:
            kept = self._columns.index(frozenset(e.name for e in self._effects if e.owner in owners))
            coefficients = np.where(np.isin(np.arange(self._columns.total), kept), coefficients, 0.0)
        return predicted(self._effects, self._source, data, model.templates, coefficients)

    def part(
        self, data: RunData, model: Prediction, names: frozenset[str], searched: Sequence[TemplateSpec]
    ) -> FloatArray:
        """What some effects add to the predicted rate, rad/s, shape (n, 3): by their columns, or by a delay alone.

        Args:
            data: The run.
            model: The model that has them.
            names: The effects.
            searched: Their searched parameters; those by which an effect exists take their defaults without it.

        """
        own = np.isin(np.arange(self._columns.total), self._columns.index(names))
        templates = model.templates
        for t in searched:
            templates = templates.set(t.field, t.default) if t.owns_effect else templates
        without = replace(
            model,
            beta=np.where(own, 0.0, model.beta),
            templates=templates,
            alignment={m: np.where(own, 0.0, delta) for m, delta in model.alignment.items()},
        )
        return np.asarray(self.rate(data, model) - self.rate(data, without))

    def without(self, data: RunData, model: Prediction) -> FloatArray:
        """Measured minus predicted rate, bias still in it, straight across what was not measured, shape (n, 3)."""
        return self._without(data, model)

    def _without_model(self, data: RunData, model: Prediction) -> FloatArray:
        return bridged(data.run.angular_rate - self.rate(data, model), data.run.valid)


def bridged(series: FloatArray, known: BoolArray) -> FloatArray:
    """The series (n, 3) with straight lines where it is not known: an interpolated rate is no error of the model.

    A line's ends are the means of as many samples beside the gap as it lacks (fewer where others are missing too):
    through single samples it would carry their noise over the whole of a long gap, which no low-pass takes out.
    """
    if known.all():
        return series
    places = np.arange(len(series))
    out = np.stack([np.interp(places, places[known], axis[known]) for axis in series.T], axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ~known, [False]])))
    for start, stop in edges.reshape(-1, 2):
        lacking = stop - start
        sides = [slice(max(0, start - lacking), start), slice(stop, stop + lacking)]
        ends = [series[side][known[side]].mean(axis=0) for side in sides if known[side].any()]
        if lacking > 1 and ends:
            out[start:stop] = np.linspace(ends[0], ends[-1], lacking)
    return out


def session_biases(runs: Sequence[RunData], remains: Mapping[RunData, FloatArray]) -> dict[int, FloatArray]:
    """One bias a session: from its fit runs; a session without any from its first still stretch, else from all of it.

    Args:
        runs: All runs.
        remains: Measured minus predicted of each run, (n, 3).

    Returns:
        Bias by session, rad/s, shape (3,).

    """
    out: dict[int, FloatArray] = {}
    for session in sorted({r.run.session for r in runs}):
        members = [r for r in runs if r.run.session == session]
        fitted = [remains[r] for r in members if r.is_fit]
        if fitted:
            out[session] = np.concatenate(fitted).mean(axis=0)
            continue
        rest = next((remains[r][w.start : w.stop] for r in members for w in r.windows if not w.moving), None)
        out[session] = (np.concatenate([remains[r] for r in members]) if rest is None else rest).mean(axis=0)
    return out
