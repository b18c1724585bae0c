"""Numbers that both reports have beside their effects: noise, delay, errors."""

from __future__ import annotations

from math import log, sqrt

from scipy.stats import norm

from gsense_fusion.identification.types import Parameter

from .changes import ScalarChange
from .snapshot import Snapshot

LEAST_NOISE_RATIO = 1.05
LEAST_DELAY_S = 2e-4
"""Less is beneath notice, however sure: filters, temperature and stamps do as much."""


def noise(old: Snapshot, new: Snapshot) -> list[ScalarChange]:
    """Noise at rest, axis by axis."""
    out = []
    for axis in (x for x in old.noise if x in new.noise):
        a, b = old.noise[axis], new.noise[axis]
        if min(a.value, b.value) <= 0.0:
            continue
        ratio = log(b.value / a.value)
        z = abs(ratio) / max(sqrt((a.stderr / a.value) ** 2 + (b.stderr / b.value) ** 2), 1e-12)
        relevant = abs(ratio) > log(LEAST_NOISE_RATIO)
        out.append(ScalarChange(f"noise {axis}", a.unit, a, b, float(2 * norm.sf(z)), relevant))
    return out


def delay(old: Snapshot, new: Snapshot) -> list[ScalarChange]:
    """Delay of the IMU against the encoder."""
    a, b = old.delay, new.delay
    if a is None or b is None:
        return []
    z = abs(b.value - a.value) / max(sqrt(a.stderr**2 + b.stderr**2), 1e-9)
    return [ScalarChange("delay of the IMU", "s", a, b, float(2 * norm.sf(z)), abs(b.value - a.value) > LEAST_DELAY_S)]


def errors(old: Snapshot, new: Snapshot) -> list[ScalarChange]:
    """Errors and floor: said, not tested, for they depend on the runs."""
    names = {"raw": "rate error, bias alone", "full": "rate error, full model", "noise_floor": "noise floor"}
    return [
        ScalarChange(
            text, "rad/s", Parameter(old.rate_rms[n], 0.0, "rad/s"), Parameter(new.rate_rms[n], 0.0, "rad/s"), None
        )
        for n, text in names.items()
        if n in old.rate_rms and n in new.rate_rms
    ]
