"""From a bag's arrays to what the estimator takes, and to the reference by which it is judged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from gsense_fusion.bags import Run
from gsense_fusion.compensation import CompensationFile, rail_power
from gsense_fusion.rotations import enu_to_ned

from .accuracy import AccuracyError, Reference, at_samples, moving_carriage, reference_of, resting
from .interface import FloatArray, IntArray
from .offline import Recording


def recording_of(run: Run, *, use_mag: bool = True) -> tuple[Recording, NDArray[np.intp]]:
    """What the live node would have received, samples in the order of their reception.

    Returns:
        The recording, and for each of its samples its row in `run.imu`.
    """
    order = np.argsort(run.imu.received_ns, kind="stable")
    mag = run.mag if use_mag else None
    finite = np.isfinite(mag.field).all(axis=1) if mag is not None else None
    joint, pose = run.joint, run.pose
    carriage = (
        (joint.stamp_ns, joint.position)
        if joint is not None and np.isfinite(joint.position).any()
        else (pose.stamp_ns, pose.position)
        if pose is not None
        else None
    )
    own = run.own if run.own is not None else run.imu
    turned = np.isfinite(own.orientation).all(axis=1) if own.orientation is not None else None
    recording = Recording(
        run.imu.stamp_ns[order],
        np.ascontiguousarray(run.imu.angular_rate[order]),
        np.ascontiguousarray(run.imu.specific_force[order]),
        (mag.stamp_ns[finite], np.ascontiguousarray(mag.field[finite])) if mag is not None else None,
        (run.temperature.stamp_ns, run.temperature.value) if run.temperature is not None else None,
        (run.battery.stamp_ns, run.battery.value) if run.battery is not None else None,
        carriage,
        joint.velocity if joint is not None and carriage is not None and carriage[0] is joint.stamp_ns else None,
        (own.stamp_ns[turned], np.ascontiguousarray(own.orientation[turned])) if own.orientation is not None else None,
    )
    return recording, order


def reference_of_run(run: Run, file: CompensationFile | None, stamp_ns: IntArray) -> Reference:
    """The reference at samples: `/reference/pose`, else the carriage, which turns but as the file's `reference` says.

    Args:
        run: the bag.
        file: may say how the rig turns the board.
        stamp_ns: increasing stamps of samples of the run, shape (n,).

    Raises:
        AccuracyError: the bag has no reference, or none that can be used.
    """
    imu = run.imu
    if run.reference is not None:
        orientation = at_samples(stamp_ns, run.reference.stamp_ns, run.reference.orientation)
        rows = np.searchsorted(imu.stamp_ns, stamp_ns)
        moving = ~resting(stamp_ns, imu.angular_rate[rows], imu.specific_force[rows])
        return reference_of(stamp_ns, orientation, moving)
    place = run.encoder
    if place is None:
        raise AccuracyError("the bag has neither /reference/pose nor rig/*")
    known = (stamp_ns >= place.stamp_ns[0]) & (stamp_ns <= place.stamp_ns[-1])
    position = np.interp(stamp_ns, place.stamp_ns, place.position)
    turn = Rotation.from_rotvec(_rig_turn(file, position)).as_quat()[:, [3, 0, 1, 2]]
    moving = moving_carriage(stamp_ns, place.stamp_ns, place.position)
    return reference_of(stamp_ns, np.where(known[:, None], turn, np.nan), moving)


def with_reference_from_ned(run: Run) -> Run:
    """The run with its reference's attitude in the east-north-up frame, from one in north-east-down."""
    if run.reference is None:
        return run
    turn = Rotation.from_matrix(enu_to_ned())
    body = Rotation.from_quat(run.reference.orientation[:, [1, 2, 3, 0]])
    attitude = (turn * body).as_quat()[:, [3, 0, 1, 2]]
    return replace(run, reference=replace(run.reference, orientation=attitude))


def _rig_turn(file: CompensationFile | None, position: FloatArray) -> FloatArray:
    """True turn of the board along the rail, rotation vector in its own axes, rad, shape (n, 3)."""
    turn = np.zeros((len(position), 3))
    for term in file.reference if file is not None else ():
        if term.effect == "rail_curvature":
            for key, value in term.parameters.items():
                if (power := rail_power(key)) is not None:
                    turn += np.outer(position**power, np.asarray(value))
    return turn
