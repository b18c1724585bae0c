"""The size of what no mounting has shown of G follows what was shown."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.outcome.unseen import TYPICAL_G, unseen_variance

PLAUSIBLE = np.full(9, 3e-4)
NOISE = 2e-6


def seen_along(along: np.ndarray) -> np.ndarray:
    """Covariance of G, row by row, of which the column along one direction is known to `NOISE`, shape (9, 9)."""
    shown = np.outer(along, along)
    return np.kron(np.eye(3), NOISE**2 * shown + PLAUSIBLE[0] ** 2 * (np.eye(3) - shown))


@pytest.mark.parametrize("size", [0.2, 1.0, 5.0])
def test_intervals_of_the_column_shown_cover_whatever_the_size_of_g(size: float) -> None:
    along = np.array([0.995, 0.08, 0.06])
    along /= np.linalg.norm(along)
    rng = np.random.default_rng(3)
    covered = []
    for _ in range(2000):
        g = size * TYPICAL_G * rng.standard_normal((3, 3))
        found = np.outer(g @ along + NOISE * rng.standard_normal(3), along).ravel()
        covariance = seen_along(along)
        stderr = np.sqrt(np.diag(covariance) + unseen_variance(found, covariance, PLAUSIBLE))
        covered.append(np.abs(found - g.ravel())[[0, 3, 6]] < 1.96 * stderr[[0, 3, 6]])
    assert 0.90 <= np.mean(covered) <= (0.99 if size >= 1.0 else 1.0)


def test_nothing_changes_where_all_of_g_was_shown_or_none() -> None:
    all_shown = NOISE**2 * np.eye(9)
    none_shown = np.diag(PLAUSIBLE**2)
    assert not unseen_variance(np.full(9, 1e-4), all_shown, PLAUSIBLE).any()
    assert not unseen_variance(np.zeros(9), none_shown, PLAUSIBLE).any()
