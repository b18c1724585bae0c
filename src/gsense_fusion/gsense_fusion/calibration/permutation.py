"""Permutation test of g-sensitivity on still poses: would other directions of gravity have done as well?"""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.likelihood import Fit, Likelihood
from gsense_fusion.identification.types import FloatArray

PERMUTATIONS = 999
SEED = 20


def permutation_p_value(likelihood: Likelihood, null: Fit) -> float | None:
    """Probability that poses exchanged at random explain as much as the true ones.

    The statistic is the drop of the whitened squared error of the pose means when G joins the model; the drift is that
    of the model without G.

    Args:
        likelihood: the data.
        null: the fit without g-sensitivity.

    Returns:
        The p-value; None where a run moves (motion is no pose).
    """
    if any(w.moving for r in likelihood.campaign.fit for w in r.windows):
        return None
    blocks = likelihood.blocks
    X = likelihood.block_columns(null.templates)
    first = likelihood.columns.start["g_sensitivity"]
    force = X[:, 0, first : first + 3]  # the first row of G sees the specific force itself
    poses, member = np.unique(blocks.run, return_inverse=True)
    of_pose = np.array([force[member == i].mean(axis=0) for i in range(len(poses))])
    whitened = [_whiten(likelihood, null, axis, X) for axis in likelihood.slow]
    rng = np.random.default_rng(SEED)
    true = _explained(whitened, of_pose[member])
    beaten = sum(
        _explained(whitened, of_pose[rng.permutation(len(poses))][member]) >= true for _ in range(PERMUTATIONS)
    )
    return (1 + beaten) / (1 + PERMUTATIONS)


def _whiten(likelihood: Likelihood, null: Fit, axis: int, X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Projector that whitens and takes out the sessions' biases, shape (b, b), and the null's residual through it."""
    slow = likelihood.slow[axis]
    factor = np.linalg.cholesky(slow.covariance(null.drift[axis]))
    H = np.linalg.solve(factor, slow.sessions)
    Q, _ = np.linalg.qr(H)
    W = np.linalg.inv(factor)
    W = W - Q @ (Q.T @ W)
    return W, W @ (likelihood.blocks.rate[:, axis] - X[:, axis, :] @ null.beta)


def _explained(whitened: list[tuple[FloatArray, FloatArray]], force: FloatArray) -> float:
    """Squared error that columns of specific force remove, summed over the gyro axes."""
    total = 0.0
    for W, y in whitened:
        Q, _ = np.linalg.qr(W @ force)
        total += float(np.sum((Q.T @ y) ** 2))
    return total
