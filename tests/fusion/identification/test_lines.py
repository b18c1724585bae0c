"""Lines in motion against a hump of the noise: many windows find its highest bin, a few at rest do not."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from gsense_fusion.identification.campaign import Window
from gsense_fusion.identification.likelihood.bins import window_bins
from gsense_fusion.identification.noise.spectrum import NoiseModel
from gsense_fusion.identification.types import FloatArray
from gsense_fusion.identification.verdict.lines import equal_at_rest, pooled_lines, single_lines
from gsense_fusion.identification.verdict.residual import WindowResidual

RATE_HZ = 100.0
HUMP_HZ = 14.8
WHITE = NoiseModel(1.0, 0.0, 0.0, np.array([4.0]), np.array([1.0]))
ALPHA = 0.004 / 14


def _windows(rng: np.random.Generator, count: int, seconds: float, moving: bool, line: float) -> list[WindowResidual]:
    """Windows of noise with a hump of 0.3 Hz; `line`: power of a tone there over the noise's."""
    n = int(seconds * RATE_HZ)
    bins = window_bins(n, RATE_HZ, dict.fromkeys(range(3), WHITE), 40.0)
    density = 1.0 + 4.0 * np.exp(-(((bins.frequency - HUMP_HZ) / 0.12) ** 2))
    data: Any = SimpleNamespace(run=SimpleNamespace(rate_hz=RATE_HZ, name="run"), motion=None)
    out = []
    for _ in range(count):
        spectrum: FloatArray = rng.standard_normal((2, len(bins.frequency), 3)) * np.sqrt(density)[:, None]
        spectrum[:, int(np.argmin(np.abs(bins.frequency - HUMP_HZ)))] += np.sqrt(line)
        out.append(WindowResidual(data, Window(0, n, moving), bins, spectrum))
    return out


def _foreign(seed: int, line: float) -> bool:
    rng = np.random.default_rng(seed)
    moving, still = _windows(rng, 12, 30.0, True, line), _windows(rng, 2, 60.0, False, 0.0)
    found = single_lines(moving, ALPHA, still) + pooled_lines(moving, ALPHA, still)
    return any(not equal_at_rest(x, moving, still) for x in found)


def test_the_highest_bin_of_a_hump_that_rest_has_too_is_no_line() -> None:
    assert sum(_foreign(seed, 0.0) for seed in range(60)) <= 2


def test_a_tone_on_the_hump_in_motion_alone_is_one() -> None:
    assert all(_foreign(seed, 40.0) for seed in range(10))
