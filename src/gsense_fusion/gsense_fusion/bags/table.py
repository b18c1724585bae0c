"""A topic's decoded columns, and what of them the sensor does not report (covariance[0] of -1, REP 145)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import cdr


@dataclass
class Table:
    """A topic's columns in order of their stamps."""

    stamp_ns: NDArray[np.int64]
    received_ns: NDArray[np.int64]
    columns: cdr.Columns
    frame_id: str = ""

    def take(self, rows: NDArray[np.intp]) -> Table:
        """The given rows, in the given order."""
        columns = {key: value[rows] for key, value in self.columns.items()}
        return Table(self.stamp_ns[rows], self.received_ns[rows], columns, self.frame_id)

    def column(self, name: str) -> NDArray[np.float64]:
        """A column by its field's name; NaN, shape (n,), where the messages have none."""
        return self.columns.get(name, np.full(len(self.stamp_ns), np.nan))


def reported(table: Table, name: str) -> NDArray[np.float64]:
    """A field's values, shape (n, 3); NaN where the sensor does not report it."""
    values = table.column(name)
    absent = table.column(f"{name}_covariance")[:, 0] == -1.0
    return np.where(absent[:, None], np.nan, values) if absent.any() else values


def attitude(table: Table) -> NDArray[np.float64] | None:
    """The sensor's own attitude, w first, shape (n, 4); None where it is never reported."""
    absent = table.column("orientation_covariance")[:, 0] == -1.0
    if absent.all():
        return None
    turn = table.column("orientation")[:, [3, 0, 1, 2]]
    norm = np.linalg.norm(turn, axis=1, keepdims=True)
    known = ~absent[:, None] & (norm > 0)
    if not known.any():
        return None
    return np.where(known, turn / np.where(norm > 0, norm, 1.0), np.nan)
