"""A finding's fitted curve over its data, as the report draws it."""

from __future__ import annotations

from dataclasses import dataclass

from gsense_fusion.identification.types import FloatArray


@dataclass(frozen=True, eq=False)
class Curve:
    """Data and what the finding says of them."""

    x: FloatArray
    """Shape (n,), increasing."""
    measured: FloatArray
    """Shape (n, k); NaN where there is none."""
    fitted: FloatArray
    """Shape (n, k)."""
    series: tuple[str, ...]
    """Names of the k series; empty for a single one."""
    x_label: str
    y_label: str
    how_to_read: str
