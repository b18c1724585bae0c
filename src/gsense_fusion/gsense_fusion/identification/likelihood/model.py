"""Likelihood of a model (a set of effects with template values) over fast and slow data together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.campaign import Campaign
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.felt.channel import ForceChannel
from gsense_fusion.identification.likelihood.alignment import Tolerance, differences, marginalise
from gsense_fusion.identification.likelihood.blocks import block_means, cut_blocks
from gsense_fusion.identification.likelihood.gram import Columns, Gram
from gsense_fusion.identification.likelihood.identified import solve
from gsense_fusion.identification.likelihood.slow import Drift, SlowNoise, estimate_drifts, initial_drift
from gsense_fusion.identification.likelihood.whitened import WhitenedCampaign
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import FloatArray, IntArray, Owner

DRIFT_ROUNDS = 3
FIRST_SIZE = 2.0
"""Plausible sizes of a turn's parameters before anything is known of them: their tolerance begins wide."""
ALIGNMENT_ROUNDS = 2
MIN_REST_BLOCKS = 8


@dataclass(frozen=True)
class Fit:
    """A model with its maximum-likelihood parameters."""

    names: frozenset[str]
    templates: Templates
    loglik: float
    beta: FloatArray
    """Every column's coefficient, zero where its effect is not in the model, shape (P,)."""
    covariance: FloatArray
    """Shape (P, P)."""
    rank: int
    """Number of parameters that this data identifies."""
    drift: Mapping[int, Drift]
    alignment: Mapping[int, FloatArray]
    """Difference of each mounting's coefficients from `beta` (gyro alignment on true rotations), shape (P,)."""
    best_loglik: float
    """Log-likelihood at the best alignment instead of integrated over it: for comparing rivals of any freedom."""
    expected: FloatArray
    """`beta` with what is to be expected in the directions that it leaves at zero, shape (P,): for predictions."""

    def beta_in(self, mounting: int | None) -> FloatArray:
        """Coefficients in one mounting, shape (P,)."""
        return self.beta if mounting is None or mounting not in self.alignment else self.beta + self.alignment[mounting]


def _squares(fit: Fit) -> FloatArray:
    """Expected squares of a fit's parameters, shape (P,)."""
    return np.asarray(fit.beta**2 + np.maximum(np.diag(fit.covariance), 0.0))


@dataclass(frozen=True, eq=False)
class _Posed:
    """The linear problem of a model at given drift, in its own columns alone (k of them)."""

    names: frozenset[str]
    templates: Templates
    drift: Mapping[int, Drift]
    index: IntArray
    """Where its columns stand among all, shape (k,)."""
    fast: Mapping[int, Gram]
    """Moving windows, by mounting."""
    felt: tuple[Gram, ...]
    """The accelerometer's part, by mounting."""
    slow: Gram
    """Block means."""


class Likelihood:
    """Evaluates models on the fit runs of a campaign."""

    def __init__(
        self,
        campaign: Campaign,
        source: DriverSource,
        effects: tuple[Effect, ...],
        noise: Mapping[int, NoiseModel],
        in_motion: Mapping[int, NoiseModel] | None = None,
    ) -> None:
        """Prepare the data.

        Args:
            campaign: The runs.
            source: What drives the effects.
            effects: The catalogue.
            noise: At rest, by gyro axis.
            in_motion: What weighs the moving windows, where it is not that.

        """
        self.campaign = campaign
        self.source = source
        self.effects = effects
        self.noise = noise
        self.columns = Columns.of(effects)
        self.cuts = cut_blocks(campaign.fit)
        self.fast = WhitenedCampaign(campaign, source, effects, in_motion or noise, self.cuts)
        self.felt = ForceChannel(campaign, source, effects)
        self.blocks = block_means(campaign.fit, self.cuts)
        self.slow = {axis: SlowNoise(self.blocks, model.psd(np.array([0.5]))[0]) for axis, model in noise.items()}
        self.rest_drift = initial_drift(noise)
        turning = tuple(e for e in effects if e.owner is Owner.RIG and e.parameters)
        self._rotations = self.columns.vectors(turning)
        self._turning = frozenset(e.name for e in turning)
        self.searched: dict[tuple[frozenset[str], Templates, str], tuple[FloatArray, FloatArray]] = {}
        """What `interval.searched` found out."""
        self.tops: dict[tuple[frozenset[str], Templates, str], list[Fit]] = {}
        """What `other_tops.other_tops` found out."""
        self._slow_names = frozenset(e.name for e in effects if e.slow)
        self._slow_fields = frozenset(t.field for e in effects if e.slow for t in e.templates)
        self._drifts: dict[tuple[frozenset[str], Templates], dict[int, Drift]] = {}
        moves = any(w.moving for r in campaign.fit for w in r.windows)
        self.samples = (sum(len(r.run) for r in campaign.fit) if moves else len(self.blocks)) * len(noise)

    def block_columns(self, templates: Templates, names: frozenset[str] | None = None) -> FloatArray:
        """Design of the blocks, shape (b, 3, P); zero beside the columns of `names` (of all where None)."""
        names = frozenset(self.columns.start) if names is None else names
        out = np.zeros((len(self.blocks), 3, self.columns.total))
        out[:, :, self.columns.index(names)] = self._block_part(names, templates)
        return out

    def _block_part(self, names: frozenset[str], templates: Templates) -> FloatArray:
        """Design of the blocks for the columns of some effects, in their order, shape (b, 3, k)."""
        empty = np.zeros((len(self.blocks), 3, 0))
        parts = [self.fast.block_means(e, templates) for e in self.effects if e.parameters and e.name in names]
        return np.concatenate([empty, *parts], axis=2)

    def drift_at_rest(self, fit: Fit) -> dict[int, Drift]:
        """Drift strengths from the blocks at rest alone, slow effects removed; the fit's where rest is rare.

        What the model lacks in motion must not pass for drift when the noise floor is asked for.
        """
        still = np.array([not w.moving for _, w in self.cuts])
        if still.sum() < MIN_REST_BLOCKS or still.all():
            return dict(fit.drift)
        blocks = self.blocks.part(still)
        residual = (self.blocks.rate - self.block_columns(fit.templates, fit.names) @ fit.beta)[still]
        slow = {axis: SlowNoise(blocks, model.white_psd) for axis, model in self.slow.items()}
        X = self._block_part(fit.names, fit.templates)[still]
        return estimate_drifts(slow, residual, self._plausible_sizes(fit.names, X))

    def _plausible_sizes(self, names: frozenset[str], X: FloatArray) -> dict[int, FloatArray]:
        """Columns (b, 3, k) of some effects in plausible sizes, by axis, shape (b, k)."""
        sized = X * self.columns.plausible[self.columns.index(names)]
        return {axis: sized[:, axis, :] for axis in self.slow}

    def slow_gram(self, templates: Templates, drift: Mapping[int, Drift], names: frozenset[str] | None = None) -> Gram:
        """Normal equations of the block means, for the columns of `names` (all where None; the others zero)."""
        names = frozenset(self.columns.start) if names is None else names
        index = self.columns.index(names)
        total = self._slow_part(self._block_part(names, templates), drift)
        xx, xy = np.zeros((self.columns.total, self.columns.total)), np.zeros(self.columns.total)
        xx[np.ix_(index, index)], xy[index] = total.xx, total.xy
        return Gram(xx, xy, total.yy, total.rows)

    def _slow_part(self, X: FloatArray, drift: Mapping[int, Drift]) -> Gram:
        """Normal equations of the block means for columns (b, 3, k)."""
        total = Gram.zero(X.shape[2])
        for axis, slow in self.slow.items():
            total = total + slow.gram(X[:, axis, :], self.blocks.rate[:, axis], drift[axis])
        return total

    def evaluate(self, names: frozenset[str], templates: Templates, start: Fit | None = None, *, kept: int = 0) -> Fit:
        """Fit a model.

        Args:
            names: Its effects.
            templates: Values of the searched parameters.
            start: A fit whose drift and alignment tolerance are kept; both are estimated where it is None.
            kept: Rank of the fit that this one is compared with while searched parameters move: a direction that comes
                or goes on the way would be a step in the likelihood, at which a search ends and an interval stops.

        """
        if start is not None:
            return self._solve(self._posed(names, templates, start.drift), _squares(start), kept)
        posed = self._posed(names, templates, self._drift_of(names, templates))
        fit = self._solve(posed, (FIRST_SIZE * self.columns.plausible) ** 2, kept)
        for _ in range(ALIGNMENT_ROUNDS if names & self._turning else 0):
            fit = self._solve(posed, _squares(fit), kept)
        return fit

    def _drift_of(self, names: frozenset[str], templates: Templates) -> dict[int, Drift]:
        """Drift strengths for a model: they depend only on what moves the block means."""
        names, templates = names & self._slow_names, templates.only(self._slow_fields)
        key = (names, templates)
        if key not in self._drifts:
            self._drifts[key] = self._settled_drift(names, templates)
        return dict(self._drifts[key])

    def _settled_drift(self, names: frozenset[str], templates: Templates) -> dict[int, Drift]:
        """Coefficients and drift in turn until the strengths stay, from what rest says."""
        X = self._block_part(names, templates)
        index = self.columns.index(names)
        columns = self._plausible_sizes(names, X)
        drift: dict[int, Drift] = {}
        for _ in range(DRIFT_ROUNDS):
            fit = self._solve(self._posed(names, templates, drift or self.rest_drift), np.zeros(self.columns.total))
            before, drift = drift, estimate_drifts(self.slow, self.blocks.rate - X @ fit.beta[index], columns, drift)
            if before and all(drift[axis].like(before[axis]) for axis in drift):
                break
        return drift

    def _posed(self, names: frozenset[str], templates: Templates, drift: Mapping[int, Drift]) -> _Posed:
        index = self.columns.index(names)
        fast = self.fast.mounting_grams(templates, names)
        felt = tuple(g.part(index) for g in self.felt.grams(names, templates).values())
        slow = self._slow_part(self._block_part(names, templates), drift)
        return _Posed(names, templates, drift, index, fast, felt, slow)

    def _solve(self, posed: _Posed, square: FloatArray, kept: int = 0) -> Fit:
        """Least squares; the tolerance of alignment is that of coefficients with these squares (P,)."""
        index, drift = posed.index, posed.drift
        tolerance = Tolerance.of(square, self._rotations, index).among(index)
        marginals = {m: marginalise(g, tolerance) for m, g in posed.fast.items()}
        turned = [marginalise(g, tolerance) for g in posed.felt]
        felt = sum((m.gram for m in turned), Gram.zero(len(index)))
        fast = sum((m.gram for m in marginals.values()), felt)
        plausible = self.columns.plausible[index]
        everything = np.arange(len(index))
        found = solve(fast + posed.slow, everything, plausible, felt if turned else None, kept)
        part = found.part
        logdet = sum(slow.logdet(drift[axis]) for axis, slow in self.slow.items())
        best = self._loglik(fast, part) + self._loglik(posed.slow, part) - 0.5 * logdet
        # in a single mounting its difference cannot be told from the coefficients themselves
        spread = sum(m.logdet for m in marginals.values()) * (len(marginals) > 1) + sum(m.logdet for m in turned)
        loglik = best - 0.5 * spread
        delta = {m: self._all(d, index) for m, d in differences(posed.fast, marginals, tolerance, part).items()}
        full = np.zeros((self.columns.total, self.columns.total))
        full[np.ix_(index, index)] = found.covariance
        beta, expected = self._all(part, index), self._all(found.expected, index)
        return Fit(posed.names, posed.templates, loglik, beta, full, found.rank, drift, delta, best, expected)

    def moving_loglik(self, fit: Fit) -> float:
        """Log-likelihood of the moving windows alone at a fit's parameters: no drift reaches into it."""
        grams = self.fast.mounting_grams(fit.templates, fit.names)
        index = self.columns.index(fit.names)
        return sum(self._loglik(gram, fit.beta_in(mounting)[index]) for mounting, gram in grams.items())

    def _all(self, part: FloatArray, index: IntArray) -> FloatArray:
        """Coefficients (k,) among all columns, zero elsewhere, shape (P,)."""
        out = np.zeros(self.columns.total)
        out[index] = part
        return out

    @staticmethod
    def _loglik(gram: Gram, beta: FloatArray) -> float:
        return -0.5 * (gram.yy - 2 * float(beta @ gram.xy) + float(beta @ gram.xx @ beta))
