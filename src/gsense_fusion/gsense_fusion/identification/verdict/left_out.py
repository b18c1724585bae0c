"""Does an effect hold on the runs, or the poses, that are left out in turn?"""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.likelihood.gram import Gram
from gsense_fusion.identification.likelihood.identified import solve
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.search.selection import Selection
from gsense_fusion.identification.types import BoolArray, FloatArray, IntArray
from gsense_fusion.identification.verdict.models import fit_without


def survives(selection: Selection, best: Fit, name: str) -> bool:
    """Whether, on every run left out in turn, the effect fitted on the others gains likelihood in sum."""
    likelihood = selection.likelihood
    without = fit_without(selection, best, name)
    if not any(w.moving for r in likelihood.campaign.fit for w in r.windows):  # still poses only
        return _pose_errors(likelihood, best) < _pose_errors(likelihood, without)
    return _motion_loglik(likelihood, best) > _motion_loglik(likelihood, without)


def _pose_errors(likelihood: Likelihood, fit: Fit) -> float:
    """Squared error of each pose's blocks predicted by least squares on the others."""
    X = likelihood.block_columns(fit.templates, fit.names)
    index = likelihood.columns.index(fit.names)
    total = 0.0
    poses = np.unique(likelihood.blocks.run)
    for pose in poses:
        out = likelihood.blocks.run == pose
        beta, bias = _solve_without(likelihood, X, index, ~out)
        error = likelihood.blocks.rate[out] - X[out][:, :, index] @ beta - bias
        total += float(np.sum(error**2))
    return total


def _solve_without(
    likelihood: Likelihood, X: FloatArray, index: IntArray, keep: BoolArray
) -> tuple[FloatArray, FloatArray]:
    k = int(keep.sum())
    columns = np.concatenate([X[keep][:, :, index], np.repeat(np.eye(3)[None], k, axis=0)], axis=2)
    weight = np.sqrt(likelihood.blocks.duration[keep])
    A = (columns * weight[:, None, None]).reshape(3 * k, -1)
    y = (likelihood.blocks.rate[keep] * weight[:, None]).reshape(-1)
    beta, *_ = np.linalg.lstsq(A, y, rcond=1e-9)
    return beta[: len(index)], beta[len(index) :]


def _motion_loglik(likelihood: Likelihood, fit: Fit) -> float:
    """Log-likelihood of every run's motion under coefficients from the other runs."""
    grams = likelihood.fast.grams(fit.templates, fit.names)
    slow = likelihood.slow_gram(fit.templates, fit.drift, fit.names)
    total = sum(likelihood.felt.grams(fit.names, fit.templates).values(), slow)
    moving = sum(gram.rows > 0 for gram in grams)
    for gram in grams:
        total = total + gram
    index = likelihood.columns.index(fit.names)
    value = 0.0
    for gram in grams:
        if gram.rows == 0:
            continue
        rest = Gram(total.xx - gram.xx, total.xy - gram.xy, total.yy - gram.yy, total.rows - gram.rows)
        part = solve(rest, index, likelihood.columns.plausible).part
        xx = gram.xx[np.ix_(index, index)]
        value -= 0.5 * (gram.yy - 2 * float(part @ gram.xy[index]) + float(part @ xx @ part))
        beta = np.zeros(len(fit.beta))
        beta[index] = part
        value += likelihood.felt.loglik(fit, beta) / moving
    return value
