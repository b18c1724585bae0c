"""`replay`: filters over a bag, offline, into a new bag and a table; the numbers of the live node."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from gsense_driver.user_input.arguments import ArgumentParser
from gsense_fusion.attitude.accuracy import Accuracy, AccuracyError, Reference, at_samples, score
from gsense_fusion.attitude.fusion import Fusion, FusionStatus
from gsense_fusion.attitude.interface import IntArray
from gsense_fusion.attitude.offline import Estimates, Recording, run_offline
from gsense_fusion.attitude.recorded import recording_of, reference_of_run, with_reference_from_ned
from gsense_fusion.attitude.registry import FILTERS, UnknownFilterError, channels, filter_kind
from gsense_fusion.bags import BagError, Run, load_run
from gsense_fusion.bags.imu_message import UNREPORTED
from gsense_fusion.bags.imu_writer import write_imu_bag
from gsense_fusion.bags.topics import sensor_name
from gsense_fusion.cli import fail
from gsense_fusion.compensation import CompensationError, CompensationFile, load_compensation
from gsense_fusion.compensation.document import write_atomically
from gsense_fusion.fusion_output import Uncertainty

SCHEMA = "gsense-accuracy/1"
OWN = "own"
"""Name of the sensor's own fusion in the table."""


class ReplayError(ValueError):
    """The bag, the filters or the file do not fit together; one line."""


@dataclass
class Replay:
    """All that a replay made."""

    run: Run
    estimates: Estimates
    stamp_ns: IntArray
    """Of the samples that were used, shape (k,)."""
    compensated: dict[str, bool]
    """Channel -> whether it had the compensated rate."""
    uses_field: bool
    status: FusionStatus
    accuracy: dict[str, dict[str, Accuracy]]
    """Filter -> `raw` or `gcomp` -> accuracy; empty without a reference."""
    notes: list[str]


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; exit code 0, or 2 with one line on stderr for unusable input."""
    options = _parser().parse_args(argv)
    try:
        file = _compensation(options.compensation, options.sensor)
        run = load_run(options.bag, options.sensor, options.reference)
        if options.reference_frame == "ned":
            run = with_reference_from_ned(run)
        result = replay(run, options.filters, file, use_mag=not options.no_mag)
        written = write(result, options.out, bag=not options.no_bag)
    except (BagError, CompensationError, UnknownFilterError, ReplayError) as error:
        return fail("replay", str(error))
    except OSError as error:
        return fail("replay", f"{error.filename or options.out}: {error.strerror or error}")
    _tell(result)
    for path in written:
        print(path)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = ArgumentParser(prog="replay", description=__doc__)
    parser.add_argument("bag", type=Path, metavar="BAG", help="rosbag2 folder, or a .mcap or .db3 file")
    parser.add_argument("--sensor", default="mpu6050", help="a sensor's name or a whole topic (default: mpu6050)")
    parser.add_argument(
        "--filters", nargs="+", metavar="F", help=f"default: all that the bag allows of {', '.join(FILTERS)}"
    )
    parser.add_argument(
        "--compensation", type=Path, metavar="FILE", help="compensation.yaml: every filter with it, too"
    )
    parser.add_argument(
        "--reference",
        metavar="TOPIC",
        help="attitude to judge by: PoseStamped, or an Imu with orientation (default: reference/pose, else rig/*)",
    )
    parser.add_argument(
        "--reference-frame", choices=("enu", "ned"), default="enu", help="earth frame of the reference (default: enu)"
    )
    parser.add_argument("--no-bag", action="store_true", help="only the table")
    parser.add_argument("--no-mag", action="store_true", help="do as if there were no magnetometer")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="where bag and accuracy.json go")
    return parser


def _compensation(path: Path | None, sensor: str) -> CompensationFile | None:
    if path is None:
        return None
    file = load_compensation(path)
    if sensor_name(file.sensor).strip("/") != sensor_name(sensor).strip("/"):
        raise ReplayError(f"{path}: sensor: is for {file.sensor!r}, the replay is of {sensor!r}")
    return file


def replay(
    run: Run, filters: Sequence[str] | None = None, file: CompensationFile | None = None, *, use_mag: bool = True
) -> Replay:
    """Run filters over a bag.

    Args:
        run: the bag.
        filters: names; None: all that the bag allows.
        file: what is taken off for the channels with compensation; None: there are none.
        use_mag: whether a magnetic field in the bag is used.

    Raises:
        UnknownFilterError, ReplayError: a filter that is not there, or that the bag does not allow.
    """
    recording, order = recording_of(run, use_mag=use_mag)
    notes = list(run.notes)
    names = _names(run, filters, recording, notes)
    fusion = Fusion(channels(names, with_compensation=file is not None), file)
    estimates = run_offline(fusion, recording)
    if names and not len(estimates.rows):
        raise ReplayError(f"{run.path}: {run.topic} is shorter than the second that a start needs")
    stamps = run.imu.stamp_ns[order[estimates.rows]]
    compensated = {channel.name: channel.compensated for channel in fusion.channels}
    result = Replay(run, estimates, stamps, compensated, fusion.status.uses_field, fusion.status, {}, notes)
    try:
        _score(result, names, file)
    except AccuracyError as error:
        notes.append(f"no accuracy: {error}")
    return result


def _names(run: Run, filters: Sequence[str] | None, recording: Recording, notes: list[str]) -> list[str]:
    if not np.isfinite(run.imu.angular_rate).all(axis=1).any():
        if filters:
            raise ReplayError(f"{run.path}: {run.topic} reports no angular velocity, so no filter can run")
        notes.append(f"{run.topic} reports no angular velocity: only the sensor's own attitude")
        return []
    kinds = {name: filter_kind(name) for name in filters or FILTERS}
    lacking = {name: "rig/joint_states" for name, k in kinds.items() if k.uses_carriage and recording.carriage is None}
    lacking |= {name: "<sensor>/imu/data" for name, k in kinds.items() if k.uses_own and recording.own is None}
    if filters and lacking:
        name, topic = next(iter(lacking.items()))
        raise ReplayError(f"{run.path}: {name} needs {topic}, which this bag lacks")
    return [name for name in kinds if name not in lacking]


def _score(result: Replay, names: list[str], file: CompensationFile | None) -> None:
    run, estimates = result.run, result.estimates
    if len(result.stamp_ns):
        order = np.argsort(result.stamp_ns, kind="stable")
        reference = reference_of_run(run, file, result.stamp_ns[order])
        for name in names:
            for key, channel in (("raw", name), ("gcomp", f"{name}_gcomp")):
                if channel in estimates.quaternion:
                    headed = result.uses_field or name == OWN
                    found = score(estimates.quaternion[channel][order], reference, has_heading=headed)
                    result.accuracy.setdefault(name, {})[key] = found
    own = run.own if run.own is not None else run.imu
    if own.orientation is not None and OWN not in result.accuracy:  # not asked for, or no rate beside it: as it is
        known = np.isfinite(own.orientation).all(axis=1)
        stamps = run.imu.stamp_ns
        reference = reference_of_run(run, file, stamps)
        attitude = at_samples(stamps, own.stamp_ns[known], own.orientation[known])
        missing = np.isnan(attitude).any(axis=1)
        reference = Reference(reference.orientation, reference.rest & ~missing, reference.scored & ~missing)
        if reference.rest.any() and reference.scored.any():
            attitude[missing] = (1.0, 0.0, 0.0, 0.0)
            result.accuracy[OWN] = {"raw": score(attitude, reference, has_heading=True)}


def accuracy_json(accuracy: dict[str, dict[str, Accuracy]]) -> str:
    """The document `accuracy.json`, degrees."""
    filters = {
        name: {
            key: {
                "inclination_rms": float(np.degrees(a.inclination)),
                "heading_rms": float(np.degrees(a.heading)),
                "total_rms": float(np.degrees(a.total)),
            }
            for key, a in found.items()
        }
        for name, found in accuracy.items()
    }
    return json.dumps({"schema": SCHEMA, "filters": filters}, indent=2) + "\n"


def write(result: Replay, out: Path, *, bag: bool) -> list[Path]:
    """Write the bag and accuracy.json; returns what was written.

    Raises:
        OSError: the folder is not writable.
    """
    out.mkdir(parents=True, exist_ok=True)
    written = []
    if bag and len(result.stamp_ns):
        _write_bag(result, out / "bag")
        written.append(out / "bag")
    document = out / "accuracy.json"
    if result.accuracy:
        write_atomically(document, accuracy_json(result.accuracy))
        written.append(document)
    else:
        document.unlink(missing_ok=True)  # an earlier replay's is not of this bag
    return written


def _write_bag(result: Replay, path: Path) -> None:
    run, estimates = result.run, result.estimates
    rows = np.searchsorted(run.imu.stamp_ns, result.stamp_ns)
    base = run.topic.removesuffix("/imu/data_raw")
    uncertainty = Uncertainty().covariance(heading_known=result.uses_field)
    topics = {}
    for channel, quaternion in estimates.quaternion.items():
        numbers = np.empty((len(rows), 37))
        numbers[:, :4] = quaternion[:, [1, 2, 3, 0]]
        numbers[:, 4:13] = uncertainty
        numbers[:, 13:16] = estimates.angular_rate[channel]
        numbers[:, 16:25] = run.imu.rate_covariance
        numbers[:, 25:28] = np.nan_to_num(run.imu.specific_force[rows])
        unreported = np.asarray(np.isnan(run.imu.specific_force[rows]).any(axis=1))
        numbers[:, 28:37] = np.where(unreported[:, None], UNREPORTED, run.imu.force_covariance)
        topics[f"{base}/{channel}/imu/data"] = numbers
    write_imu_bag(path, result.stamp_ns, run.imu.received_ns[rows], run.imu.frame_id, topics)


def _tell(result: Replay) -> None:
    console = Console(highlight=False, soft_wrap=True)
    status, counts = result.status, result.status.counts
    console.print(
        f"{result.run.name}: {result.run.topic}, {counts.samples} samples, {counts.missing} missing in "
        f"{counts.gaps} gaps, {counts.out_of_order} out of order, {counts.resets} resets; {status.start};"
        f" magnetometer {'used' if result.uses_field else 'not used'}"
    )
    for note in result.notes:
        console.print(f"note: {note}", markup=False)
    if not result.accuracy:
        return
    table = Table(title="error, deg rms from the first motion on", title_justify="left", box=None, header_style="")
    for column in ("filter", "rate", "inclination", "heading", "total"):
        table.add_column(column, justify="left" if column in ("filter", "rate") else "right")
    for name, found in result.accuracy.items():
        for key, a in found.items():
            table.add_row(name, key, *(f"{np.degrees(v):.4f}" for v in (a.inclination, a.heading, a.total)))
    console.print(table)


if __name__ == "__main__":
    sys.exit(main())
