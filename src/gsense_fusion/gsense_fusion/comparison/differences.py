"""The differences between two reports with their errors, and which of them are more than chance.

All tests share the chance `FALSE_ALARM` (Bonferroni). Both reports' errors are taken to be independent.
"""

from __future__ import annotations

from dataclasses import replace
from math import log

import numpy as np

from gsense_fusion.identification.types import IdentificationError

from .changes import FALSE_ALARM, Comparison, Status
from .effect_changes import cyclic, judged, ordered, pairs
from .scalar_changes import delay, errors, noise
from .snapshot import Snapshot


def compare(old: Snapshot, new: Snapshot) -> Comparison:
    """Compare two reports of the same sensor.

    Raises:
        IdentificationError: they are of different sensors.
    """
    if _bare(old.sensor) != _bare(new.sensor):
        raise IdentificationError(
            f"{new.path}: is of the sensor {new.sensor}, {old.path} of {old.sensor}: only one sensor with itself"
        )
    found = pairs(old, new)
    k = cyclic(old.effects.get("g_sensitivity"), new.effects.get("g_sensitivity"))
    scalars = (*noise(old, new), *delay(old, new), *errors(old, new))
    tests = sum(e.p_value is not None and e.status is not Status.SESSION for e in found) + (k is not None)
    level = FALSE_ALARM / max(tests + sum(s.p_value is not None for s in scalars), 1)
    effects = [judged(e, old, new, level) for e in found]
    if k is not None and k.p_value is not None and k.p_value < level:
        effects = [
            replace(e, status=Status.DRIFTED) if (e.effect, e.status) == ("g_sensitivity", Status.SAME) else e
            for e in effects
        ]
    return Comparison(old, new, tuple(ordered(effects)), k, scalars, _unexplained(old, new), _warnings(old, new), level)


def _bare(sensor: str) -> str:
    return sensor.strip("/").removesuffix("/imu/data_raw")


def _unexplained(old: Snapshot, new: Snapshot) -> Status | None:
    match (old.unexplained is not None, new.unexplained is not None):
        case (False, False):
            return None
        case (False, True):
            return Status.ENTERED
        case (True, False):
            return Status.GONE
        case _:
            return Status.SAME


def _warnings(old: Snapshot, new: Snapshot) -> tuple[str, ...]:
    out = []
    if old.unit_id != new.unit_id:
        if old.unit_id and new.unit_id:
            out.append(f"two units ({old.unit_id}, {new.unit_id}): a difference is between units, not in time")
        else:
            out.append("one report does not name its unit: that both are of the same is taken for granted")
    if set(old.declared) != set(new.declared):
        out.append(f"declared differently: OLD {', '.join(old.declared)}; NEW {', '.join(new.declared)}")
    common = old.recordings & new.recordings
    if common:
        out.append(f"{len(common)} bags are in both: the errors are not independent, the differences surer than said")
    rates = [float(np.median(s.rates_hz)) if s.rates_hz else 0.0 for s in (old, new)]
    if min(rates) > 0 and abs(log(rates[1] / rates[0])) > 0.05:
        out.append(f"sampled at {rates[0]:.0f} and {rates[1]:.0f} Hz: delay and noise may differ for that alone")
    if any("g_sensitivity" in s.effects and s.effects["g_sensitivity"].covariance is None for s in (old, new)):
        out.append("a report of an earlier version, without covariances: parameters are compared one by one")
    return tuple(out)
