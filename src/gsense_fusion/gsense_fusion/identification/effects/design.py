"""What an effect adds to the gyro, in the form that is cheapest to whiten: a few series, each spread over the axes.

Most effects have one driver and three parameters: nine columns of which all are multiples of one series. What costs is
the spectrum of a series, so it is taken once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import DTypeLike

from gsense_fusion.identification.types import FloatArray


@dataclass(frozen=True, eq=False)
class Mixed:
    """Design sum over k of series[k] times spread[k], as an array of shape (n, 3, p)."""

    series: FloatArray
    """Shape (k, n)."""
    spread: FloatArray
    """Share of each series in each axis by parameter, shape (k, 3, p)."""

    @staticmethod
    def of(design: Design) -> Mixed:
        """Any design, an array (n, 3, p) too: then every entry is a series of its own."""
        if isinstance(design, Mixed):
            return design
        n, _, p = design.shape
        spread = np.eye(3 * p).reshape(3 * p, 3, p)
        return Mixed(np.ascontiguousarray(design.reshape(n, 3 * p).T), spread)

    @staticmethod
    def beside(parts: Sequence[Mixed]) -> Mixed:
        """Parameters of several designs one after the other."""
        total = sum(m.spread.shape[2] for m in parts)
        spreads, first = [], 0
        for m in parts:
            k, _, p = m.spread.shape
            spread = np.zeros((k, 3, total))
            spread[:, :, first : first + p] = m.spread
            spreads.append(spread)
            first += p
        return Mixed(np.concatenate([m.series for m in parts]), np.concatenate(spreads))

    def __matmul__(self, beta: FloatArray) -> FloatArray:
        """Rate that the coefficients (p,) make, shape (n, 3)."""
        return np.asarray(self.series.T @ (self.spread @ beta))

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> np.ndarray[Any, Any]:
        """The columns themselves, shape (n, 3, p)."""
        return np.tensordot(self.series.T, self.spread, axes=1).astype(dtype or float, copy=False)


@dataclass(frozen=True, eq=False)
class RailForce:
    """A specific force that is one vector and an acceleration along another: two series instead of three."""

    series: FloatArray
    """Ones, then the acceleration along the rail in m/s^2, shape (2, n)."""
    spread: FloatArray
    """Direction and size of each, shape (2, 3)."""

    @cached_property
    def vectors(self) -> FloatArray:
        """m/s^2, shape (n, 3)."""
        return np.asarray(self.series.T @ self.spread)


Design = FloatArray | Mixed
