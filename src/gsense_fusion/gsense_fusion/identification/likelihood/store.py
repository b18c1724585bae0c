"""The effects' columns on every fit run: designed once for each value of their own searched parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gsense_fusion.identification.campaign import RunData, Window
from gsense_fusion.identification.drivers import DriverSource
from gsense_fusion.identification.effects.base import Effect, Templates
from gsense_fusion.identification.effects.design import Mixed
from gsense_fusion.identification.kept import kept
from gsense_fusion.identification.types import FloatArray

DELAY = "gyro_delay_s"
KEPT_EFFECTS = 4


def fields_of(effect: Effect) -> frozenset[str]:
    """Searched parameters on which an effect's columns depend: its own, and the gyro's delay where it moves."""
    own = frozenset(t.field for t in effect.templates) | frozenset(effect.fields)
    return own | {DELAY} if effect.dynamic else own


class Designs:
    """An effect's columns on a run, kept for a while: its rows in the common band and above are asked for in turn."""

    def __init__(self, source: DriverSource, runs: int) -> None:
        """Take the drivers, and of how many runs the columns of some effects are kept."""
        self._source = source
        self._kept = kept(KEPT_EFFECTS * runs, self._made)

    def of(self, effect: Effect, data: RunData, templates: Templates) -> Mixed:
        """Columns on the run's whole grid; templates: of the effect's own fields."""
        return self._kept(effect, data, templates)

    def _made(self, effect: Effect, data: RunData, templates: Templates) -> Mixed:
        return Mixed.of(effect.design(self._source.of(data, templates)))


def design(effects: Sequence[Effect], source: DriverSource, data: RunData, templates: Templates) -> FloatArray:
    """Columns of some effects on a run's whole grid, shape (n, 3, P); P is zero where nothing can be decided."""
    empty = np.zeros((len(data.run), 3, 0))
    return np.concatenate([empty, *(e.design(source.of(data, templates.only(fields_of(e)))) for e in effects)], axis=2)


def predicted(
    effects: Sequence[Effect], source: DriverSource, data: RunData, templates: Templates, beta: FloatArray
) -> FloatArray:
    """Rate that the coefficients (P,) of the effects make on a run's whole grid, rad/s, shape (n, 3)."""
    out = np.zeros((len(data.run), 3))
    first = 0
    for effect in effects:
        part = beta[first : first + len(effect.parameters)]
        first += len(effect.parameters)
        if part.any():
            out += effect.design(source.of(data, templates.only(fields_of(effect)))) @ part
    return out


def means(series: FloatArray, windows: Sequence[Window]) -> FloatArray:
    """Means over blocks of a run's series (k, n), shape (b, k); blocks are in order and do not overlap."""
    if not windows:
        return np.zeros((0, len(series)))
    edges = np.array([(w.start, w.stop) for w in windows]).ravel()
    # a sum from each start to its stop and, left out, from there to the next start
    sums = np.add.reduceat(series[:, : edges[-1]], edges[:-1], axis=1)[:, ::2]
    return np.asarray(sums / np.diff(edges)[::2]).T
