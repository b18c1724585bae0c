"""Permutation test of g-sensitivity on still poses: would other directions of gravity have done as well?"""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.types import FloatArray, IntArray

PERMUTATIONS = 999
SEED = 20


def permutation_p_value(likelihood: Likelihood, null: Fit, earth_known: bool) -> float | None:
    """Probability that poses exchanged at random explain as much as the true ones.

    The statistic is the drop of the whitened squared error of the pose means when G joins the model; the drift is that
    of the model without G. The earth's turn about the vertical looks like a multiple of the unit matrix: where it has
    not been subtracted, that one direction is in both models and proves nothing.

    Args:
        likelihood: the data.
        null: the fit without g-sensitivity.
        earth_known: whether earth rate has been subtracted.

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
    whitened = {axis: _whiten(likelihood, null, axis, X) for axis in likelihood.slow}
    y = np.concatenate([residual for _, residual in whitened.values()])
    earth = np.concatenate([W @ force[:, axis] for axis, (W, _) in whitened.items()])[:, None]
    nuisance = earth[:, :0] if earth_known else earth / np.linalg.norm(earth)

    def explained(order: IntArray) -> float:
        columns = of_pose[order][member]
        G = np.zeros((len(y), 3 * len(whitened)))
        b = len(columns)
        for i, (W, _) in enumerate(whitened.values()):
            G[i * b : (i + 1) * b, 3 * i : 3 * i + 3] = W @ columns
        U, s, _ = np.linalg.svd(np.column_stack([nuisance * _size(G), G]), full_matrices=False)
        return float(np.sum((U[:, s > 1e-9 * s[0]].T @ y) ** 2))

    rng = np.random.default_rng(SEED)
    true = explained(np.arange(len(poses))) * (1 - 1e-9)
    beaten = sum(explained(rng.permutation(len(poses))) >= true for _ in range(PERMUTATIONS))
    return (1 + beaten) / (1 + PERMUTATIONS)


def _size(columns: FloatArray) -> float:
    """Size of the columns, so that a nuisance beside them is of like size."""
    return float(np.linalg.norm(columns, axis=0).max())


def _whiten(likelihood: Likelihood, null: Fit, axis: int, X: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Projector that whitens and takes out the sessions' biases, shape (b, b), and the null's residual through it."""
    slow = likelihood.slow[axis]
    factor = np.linalg.cholesky(slow.covariance(null.drift[axis]))
    H = np.linalg.solve(factor, slow.sessions)
    Q, _ = np.linalg.qr(H)
    W = np.linalg.inv(factor)
    W = W - Q @ (Q.T @ W)
    return W, W @ (likelihood.blocks.rate[:, axis] - X[:, axis, :] @ null.beta)
