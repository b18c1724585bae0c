"""Samples of the starting window, held back until it is known whether they are at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .interface import FloatArray
from .stream import SUPPLY, TEMPERATURE, Sample


@dataclass(slots=True)
class Measured:
    """A sample with what else was known when it came."""

    stamp_ns: int
    dt: float
    rate: FloatArray
    force: FloatArray
    field: FloatArray | None
    own: FloatArray | None
    inputs: FloatArray
    source: Any


@dataclass(slots=True)
class Held:
    """A sample of the starting window, and what the streams made of it (raw, compensated)."""

    measured: Measured
    samples: tuple[Sample, ...]


def settle_inputs(inputs: list[FloatArray]) -> None:
    """What became known of temperature and supply within the first second is taken to hold from its start."""
    for column in (TEMPERATURE, SUPPLY):
        known = [row[column] for row in inputs if np.isfinite(row[column])]
        for i, row in enumerate(inputs):
            if known and (column == SUPPLY or i == 0):
                row[column] = known[-1]
            elif column == TEMPERATURE:
                row[column] = np.nan
