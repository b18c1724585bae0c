"""The magnetometer's messages and the motor's effort of a run, as recorded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gsense_fusion.bags.run import Run
from gsense_fusion.identification.types import FloatArray

FEWEST_MESSAGES = 40


@dataclass(frozen=True, eq=False)
class FieldRecord:
    """Magnetometer messages that brought a new value; time in s since the campaign's first sample."""

    time: FloatArray
    """Shape (k,)."""
    field: FloatArray
    """T, shape (k, 3), sensor axes."""


@dataclass(frozen=True, eq=False)
class MotorRecord:
    """The motor's current, or the force that stands for it."""

    time: FloatArray
    value: FloatArray
    """Shape (m,)."""
    unit: str
    """A (rig/state) or N (effort of rig/joint_states)."""


def field_record(run: Run, epoch_ns: int) -> FieldRecord | None:
    """Messages with a new value: a register read faster than its sensor measures repeats itself.

    A magnetometer beside the sensor, on the same board, is taken to have the sensor's axes.
    """
    mag = run.mag or run.mag_beside
    if mag is None:
        return None
    good = np.isfinite(mag.field).all(axis=1)
    stamps, field = mag.stamp_ns[good], mag.field[good]
    if len(stamps) < FEWEST_MESSAGES:
        return None
    new = np.concatenate([[True], (np.diff(field, axis=0) != 0.0).any(axis=1)])
    return FieldRecord((stamps[new] - epoch_ns) * 1e-9, np.asarray(field[new], dtype=float))


def motor_record(run: Run, epoch_ns: int) -> MotorRecord | None:
    """The current where rig/state has it, else the effort where it is reported and not constant."""
    current = run.motor_current
    if current is not None and np.isfinite(current.value).all() and np.ptp(current.value) > 0:
        return MotorRecord((current.stamp_ns - epoch_ns) * 1e-9, current.value, "A")
    joint = run.joint
    if joint is not None and np.isfinite(joint.effort).all() and np.ptp(joint.effort) > 0:
        return MotorRecord((joint.stamp_ns - epoch_ns) * 1e-9, joint.effort, "N")
    return None
