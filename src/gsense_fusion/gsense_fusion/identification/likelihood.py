"""Likelihood of a model (a set of effects with template values) over fast and slow data together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.blocks import block_design, block_means, cut_blocks
from gsense_fusion.identification.campaign import Campaign, DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.noise import NoiseModel
from gsense_fusion.identification.slow import Drift, SlowNoise, initial_drift
from gsense_fusion.identification.types import FloatArray, IntArray
from gsense_fusion.identification.whitened import Columns, Gram, WhitenedCampaign

RANK_TOLERANCE = 1e-8
DRIFT_ROUNDS = 3


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

    def bic_cost(self, searched: int, n: int) -> float:
        """Penalty on twice the log-likelihood: every identified and every searched parameter costs ln n."""
        return (self.rank + searched) * float(np.log(n))


def solve(gram: Gram, index: IntArray, groups: IntArray) -> tuple[FloatArray, FloatArray, int]:
    """Least squares on some columns by pseudo-inverse; unidentified directions get zero.

    Columns of one group (same effect, same unit) share one scale, so that "zero" is the smallest parameter vector in
    physical units: from one mounting, G comes out along the direction in which the board was accelerated.

    Args:
        gram: Normal equations.
        index: Columns to use, shape (k,).
        groups: Group number of every column, shape (P,).

    Returns:
        Coefficients (k,), covariance (k, k) and rank.

    """
    if len(index) == 0:
        return np.zeros(0), np.zeros((0, 0)), 0
    xx = gram.xx[np.ix_(index, index)]
    own = groups[index]
    size = np.array([np.max(np.diag(xx)[own == g]) for g in own])
    unit = np.where(size > 0, 1.0 / np.sqrt(np.where(size > 0, size, 1.0)), 0.0)
    values, vectors = np.linalg.eigh(xx * unit[:, None] * unit[None])
    good = values > RANK_TOLERANCE * max(float(values[-1]), 1e-300)
    inverse = (vectors[:, good] / values[good]) @ vectors[:, good].T
    covariance = inverse * unit[:, None] * unit[None]
    return covariance @ gram.xy[index], covariance, int(good.sum())


class Likelihood:
    """Evaluates models on the fit runs of a campaign."""

    def __init__(
        self, campaign: Campaign, source: DriverSource, effects: tuple[Effect, ...], noise: Mapping[int, NoiseModel]
    ) -> None:
        """Prepare the data; `noise` by gyro axis."""
        self.campaign = campaign
        self.source = source
        self.effects = effects
        self.noise = noise
        self.columns = Columns.of(effects)
        self.fast = WhitenedCampaign(campaign, source, effects, noise)
        self.cuts = cut_blocks(campaign.fit)
        self.blocks = block_means(campaign.fit, self.cuts)
        self.slow = {axis: SlowNoise(self.blocks, model.psd(np.array([0.5]))[0]) for axis, model in noise.items()}
        self._start = initial_drift(noise)
        self._designs: dict[Templates, FloatArray] = {}
        moves = any(w.moving for r in campaign.fit for w in r.windows)
        self.samples = (sum(len(r.run) for r in campaign.fit) if moves else len(self.blocks)) * len(noise)

    def block_columns(self, templates: Templates) -> FloatArray:
        """Design of the blocks, shape (b, 3, P)."""
        if templates not in self._designs:
            if len(self._designs) > 64:
                self._designs.clear()
            runs = self.campaign.fit
            self._designs[templates] = block_design(runs, self.cuts, self.effects, self.source, templates)
        return self._designs[templates]

    def slow_gram(self, templates: Templates, drift: Mapping[int, Drift]) -> Gram:
        """Normal equations of the block means."""
        total = Gram.zero(self.columns.total)
        X = self.block_columns(templates)
        for axis, slow in self.slow.items():
            total = total + slow.gram(X[:, axis, :], self.blocks.rate[:, axis], drift[axis])
        return total

    def fast_gram(self, templates: Templates) -> Gram:
        """Normal equations of the moving windows."""
        total = Gram.zero(self.columns.total)
        for gram in self.fast.grams(templates):
            total = total + gram
        return total

    def evaluate(self, names: frozenset[str], templates: Templates, drift: Mapping[int, Drift] | None = None) -> Fit:
        """Fit a model; the drift's strengths are estimated with it unless given."""
        fast = self.fast_gram(templates)
        index = self.columns.index(names)
        fixed = drift is not None
        current: Mapping[int, Drift] = self._start if drift is None else drift
        X = self.block_columns(templates)
        for _ in range(1 if fixed else DRIFT_ROUNDS):
            gram = fast + self.slow_gram(templates, current)
            part, covariance, rank = solve(gram, index, self.columns.groups)
            if not fixed:
                current = self._estimate_drift(X[:, :, index] @ part, current)
        if not fixed:
            part, covariance, rank = solve(fast + self.slow_gram(templates, current), index, self.columns.groups)
        beta = np.zeros(self.columns.total)
        beta[index] = part
        full = np.zeros((len(beta), len(beta)))
        full[np.ix_(index, index)] = covariance
        loglik = self._fast_loglik(fast, beta) + self._slow_loglik(X @ beta, current)
        return Fit(names, templates, loglik, beta, full, rank, dict(current))

    def _estimate_drift(self, predicted: FloatArray, current: Mapping[int, Drift]) -> dict[int, Drift]:
        residual = self.blocks.rate - predicted
        return {axis: slow.estimate(residual[:, axis], current[axis]) for axis, slow in self.slow.items()}

    @staticmethod
    def _fast_loglik(gram: Gram, beta: FloatArray) -> float:
        return -0.5 * (gram.yy - 2 * float(beta @ gram.xy) + float(beta @ gram.xx @ beta))

    def _slow_loglik(self, predicted: FloatArray, drift: Mapping[int, Drift]) -> float:
        residual = self.blocks.rate - predicted
        return sum(slow.loglik(residual[:, axis], drift[axis]) for axis, slow in self.slow.items())
