"""Errors of every filter on a bag, in segments: at rest, in motion, after it."""

from __future__ import annotations

from typing import Any

import numpy as np

from gsense_fusion.attitude.accuracy import aligned, resting
from gsense_fusion.attitude.errors import heading_error, inclination_error
from gsense_fusion.attitude.recorded import reference_of_run
from gsense_fusion.bags import Run
from gsense_fusion.compensation import CompensationFile
from gsense_fusion.replay import replay

Errors = dict[str, dict[str, dict[str, float]]]
"""Channel -> segment -> metric -> deg rms."""


def errors(run: Run, file: CompensationFile | None) -> Errors:
    result = replay(run, None, file)
    reference = reference_of_run(run, file, result.stamp_ns)
    known = np.isfinite(reference.orientation).all(axis=1)
    parts = {name: rows & known for name, rows in segments(run, result.stamp_ns).items()}
    found: Errors = {}
    for channel, quaternion in result.estimates.quaternion.items():
        ours = aligned(quaternion, reference, has_heading=result.uses_field)
        for segment, rows in parts.items():
            true = reference.orientation[rows]
            found.setdefault(channel, {})[segment] = {
                "inclination": rms(inclination_error(ours[rows], true)),
                "heading": rms(heading_error(ours[rows], true)),
            }
    return found


def segments(run: Run, stamp_ns: Any) -> dict[str, Any]:
    """Before the first motion, from it to the last one, behind that."""
    if run.pose is not None:
        speed = np.abs(np.gradient(run.pose.position, run.pose.stamp_ns * 1e-9))
        moving = np.interp(stamp_ns, run.pose.stamp_ns, speed) > 0.01
    else:
        rows = np.searchsorted(run.imu.stamp_ns, stamp_ns)
        moving = ~resting(stamp_ns, run.imu.angular_rate[rows], run.imu.specific_force[rows])
    at = np.flatnonzero(moving)
    index = np.arange(len(stamp_ns))
    return {"rest": index < at[0], "motion": (index >= at[0]) & (index <= at[-1]), "after": index > at[-1]}


def rms(values: Any) -> float:
    return float(np.degrees(np.sqrt(np.mean(np.square(values)))))
