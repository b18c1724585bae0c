"""The newest rows of a stream, without an object for each."""

from __future__ import annotations

import numpy as np

from gsense_fusion.identification.types import FloatArray


class History:
    """Rows of numbers whose first column is a time that increases; keeps the last `span_s`."""

    def __init__(self, columns: int, span_s: float, rate_hz: float = 1000.0) -> None:
        self.span_s = span_s
        self._rows = np.zeros((round(2 * span_s * rate_hz), columns))
        self._end = 0

    def __len__(self) -> int:
        return self._end

    @property
    def newest(self) -> float:
        """Time of the last row, s; -inf where there is none."""
        return float(self._rows[self._end - 1, 0]) if self._end else -np.inf

    def add(self, *values: float) -> None:
        """Append a row."""
        if self._end == len(self._rows):
            kept = self.recent()[-len(self._rows) // 2 :]
            self._rows[: len(kept)] = kept
            self._end = len(kept)
        self._rows[self._end] = values
        self._end += 1

    def recent(self) -> FloatArray:
        """A copy of the rows of the last `span_s`, shape (n, columns)."""
        first = int(np.searchsorted(self._rows[: self._end, 0], self.newest - self.span_s))
        return self._rows[first : self._end].copy()

    def clear(self) -> None:
        """Forget everything."""
        self._end = 0
