"""Sums of a linear least-squares problem, and where each effect's parameters stand in them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.types import FloatArray, IntArray


@dataclass(frozen=True)
class Gram:
    """Sums of a linear least-squares problem with unit noise: X'X, X'y, y'y and the number of rows."""

    xx: FloatArray
    xy: FloatArray
    yy: float
    rows: int

    def __add__(self, other: Gram) -> Gram:
        return Gram(self.xx + other.xx, self.xy + other.xy, self.yy + other.yy, self.rows + other.rows)

    def part(self, index: IntArray) -> Gram:
        """Of some columns."""
        return Gram(self.xx[index[:, None], index], self.xy[index], self.yy, self.rows)

    @staticmethod
    def zero(p: int) -> Gram:
        """No data yet."""
        return Gram(np.zeros((p, p)), np.zeros(p), 0.0, 0)


@dataclass(frozen=True)
class Columns:
    """Where each effect's parameters stand among the columns."""

    start: Mapping[str, int]
    count: Mapping[str, int]
    total: int
    plausible: FloatArray
    """Plausible size of each parameter, shape (P,)."""

    @staticmethod
    def of(effects: tuple[Effect, ...]) -> Columns:
        """Lay the effects out one after the other."""
        start, count, total = {}, {}, 0
        plausible: list[float] = []
        for effect in effects:
            start[effect.name] = total
            count[effect.name] = len(effect.parameters)
            total += len(effect.parameters)
            plausible.extend(p.plausible for p in effect.parameters)
        return Columns(start, count, total, np.array(plausible))

    def vectors(self, effects: tuple[Effect, ...]) -> tuple[IntArray, ...]:
        """Columns of each vector parameter (same effect, same unit) of some effects."""
        out: list[IntArray] = []
        for effect in effects:
            units = [p.unit for p in effect.parameters]
            for unit in dict.fromkeys(units):
                own = [self.start[effect.name] + i for i, u in enumerate(units) if u == unit]
                out.append(np.array(own, dtype=np.int64))
        return tuple(out)

    def index(self, names: frozenset[str]) -> IntArray:
        """Column numbers of a set of effects."""
        picked = [np.arange(self.start[n], self.start[n] + self.count[n]) for n in self.start if n in names]
        return np.concatenate(picked).astype(np.int64) if picked else np.zeros(0, dtype=np.int64)
