"""Courses that a bias may take through a session: a step, a warm-up, what was recorded beside it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.effects.base import Drivers, Templates
from gsense_fusion.identification.likelihood.model import Fit, Likelihood
from gsense_fusion.identification.likelihood.slow import Blocks
from gsense_fusion.identification.search.alternatives import known_columns, slow_residual, step_places, steps
from gsense_fusion.identification.search.chance import gains
from gsense_fusion.identification.types import FloatArray

SETTLING_S = (10.0, 30.0, 100.0, 300.0)
"""Time constants of chips, boards and housings that warm up, or of a mechanical stress that relaxes."""
RECORDED: tuple[tuple[str, Callable[[Drivers], FloatArray | None]], ...] = (
    ("the bias follows the die's temperature", lambda drivers: drivers.temperature),
    ("the bias follows the supply", lambda drivers: drivers.supply),
)


@dataclass(frozen=True, eq=False)
class Courses:
    """Columns of block means, and each one in words."""

    columns: FloatArray
    """Shape (b, k)."""
    words: tuple[str, ...]
    steps: int
    """How many of the first ones are steps."""


def courses(likelihood: Likelihood) -> Courses:
    """All courses that the fit runs' blocks can show; none where the blocks are too few for a step."""
    blocks = likelihood.blocks
    jumps = steps(blocks)
    if not jumps.shape[1]:
        return Courses(jumps, (), 0)
    places = step_places(blocks)
    words = [f"the bias steps at {t:.0f} s" for t in blocks.time[places] - blocks.duration[places] / 2]
    columns = [*jumps.T, *settling(blocks).T]
    words += [f"the bias settles over some {tau:.0f} s from the session's start" for tau in SETTLING_S]
    for text, driver in RECORDED:
        means = _block_means(likelihood, driver)
        if means is not None:
            columns.append(means)
            words.append(text)
    return Courses(np.stack(columns, axis=1), tuple(words), jumps.shape[1])


def settling(blocks: Blocks) -> FloatArray:
    """1 - exp(-t / tau) from each session's start, shape (b, taus)."""
    start = np.array([blocks.time[blocks.session == s].min() for s in blocks.session])
    return np.asarray(1.0 - np.exp(-(blocks.time - start)[:, None] / np.array(SETTLING_S)))


def rather_gradual(likelihood: Likelihood, rest: Fit, instant: float) -> str | None:
    """The course that explains what a model without a step leaves better than any step does; None where none does.

    Args:
        likelihood: Of the data.
        rest: The model without the step.
        instant: Where the step was found, s: within a block it is no step between blocks.

    """
    tried = courses(likelihood)
    found_step = _block_means(likelihood, lambda drivers: (drivers.time > instant).astype(float))
    if not tried.words or found_step is None:
        return None
    columns = np.column_stack([found_step, tried.columns])
    gained = gains(likelihood.slow, slow_residual(likelihood, rest), columns, known_columns(likelihood, rest))
    best = int(np.argmax(gained)) - 1
    return None if best < tried.steps else tried.words[best]


def _block_means(likelihood: Likelihood, driver: Callable[[Drivers], FloatArray | None]) -> FloatArray | None:
    """Of what was recorded in every run, shape (b,)."""
    out = np.zeros(len(likelihood.blocks))
    for i, (number, window) in enumerate(likelihood.cuts):
        series = driver(likelihood.source.of(likelihood.campaign.fit[number], Templates()))
        if series is None:
            return None
        out[i] = float(np.mean(series[window.start : window.stop]))
    return out
