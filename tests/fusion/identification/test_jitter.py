"""Samples are numbered rightly however their stamps jitter."""

from __future__ import annotations

import numpy as np
import pytest

from gsense_fusion.identification.recording.stamps import grid_index


@pytest.mark.parametrize("lost", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("jitter", [0.02, 0.15, 0.2, 0.25])
def test_jitter_of_a_part_of_the_period_is_no_loss(jitter: float, lost: float) -> None:
    """A driver that stamps on arrival: 1 ms at 200 Hz is a fifth of the period."""
    rng = np.random.default_rng(round(100 * jitter) + round(1000 * lost))
    kept = np.flatnonzero(rng.random(8000) >= lost)
    stamps = 10**18 + np.round((kept + jitter * rng.standard_normal(len(kept))) * 5e6).astype(np.int64)
    order = np.argsort(stamps)
    index, period = grid_index(stamps[order])
    off = index - (kept - kept[0])
    assert np.mean(off != np.median(off)) < 0.01
    assert period == pytest.approx(5e-3, rel=3e-5)


def test_samples_that_come_late_in_a_jittering_stream_are_not_lost() -> None:
    rng = np.random.default_rng(7)
    late = rng.standard_normal(8000) * 0.1 + (rng.random(8000) < 0.01) * rng.exponential(5.0, 8000)
    stamps = np.maximum.accumulate(np.round((np.arange(8000) + late) * 1e6).astype(np.int64)) + np.arange(8000)
    index, period = grid_index(stamps)
    assert np.mean(index - np.median(index - np.arange(8000)) != np.arange(8000)) < 0.02
    assert period == pytest.approx(1e-3, rel=1e-4)
