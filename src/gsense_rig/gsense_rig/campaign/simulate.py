"""Simulates a campaign into a folder: a bag per run, `index.yaml`, and apart from it `truth.yaml`."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gsense_driver.user_input.yaml_text import parse_yaml
from gsense_rig.campaign.index import INDEX, Index, checksum, is_intact, read_index, write_yaml
from gsense_rig.campaign.messages import Batch
from gsense_rig.campaign.plan import Plan, PlanRun
from gsense_rig.campaign.session import Session, SessionSpec
from gsense_rig.recording.bag import BagWriter, offered_qos, storage_file
from gsense_rig.recording.interleave import Stream, interleave
from gsense_rig.recording.typestore import typestore
from gsense_rig.sensors.effects import parse_effects
from gsense_rig.sensors.parameters import UnitParameters

TRUTH = "truth.yaml"
TRUTH_SCHEMA = "gsense-truth/1"
_WORK = ".unfinished"
Progress = Callable[[int, PlanRun, str], None]
"""Called with a run's number, its entry and "made", "kept" or "begun"."""


class SimulateError(RuntimeError):
    """The campaign cannot be simulated there; the message is one line."""


@dataclass(frozen=True)
class CampaignResult:
    """What was done."""

    folder: Path
    made: int
    kept: int
    messages: int
    simulated: float
    """s of recorded time in the runs made."""


def simulate_campaign(plan: Plan, folder: Path, spec: SessionSpec, progress: Progress | None = None) -> CampaignResult:
    """Makes the runs of the plan that the folder does not hold yet; the same plan and spec always give the same bytes.

    Raises:
        SimulateError: the folder holds something else.
        ValueError: an effect is wrong.
    """
    parse_effects(spec.effects)
    index = _open_folder(plan, folder, spec)
    kept = [is_intact(folder, entry) for entry in index.runs]
    messages, simulated = 0, 0.0
    session = None if all(kept) else Session(spec)
    for number, entry in enumerate(index.runs):
        if session is None or all(kept[number:]):
            break
        _tell(progress, number, entry.plan, "begun")
        batches = session.make_run(entry.plan)
        if not kept[number]:
            write_bag(batches, folder / entry.bag)
            index = index.with_done(number, checksum(storage_file(folder / entry.bag)))
            index.write(folder)
            messages += sum(batch.rows.shape[0] for batch in batches)
            simulated += _span(batches)
        _tell(progress, number, entry.plan, "kept" if kept[number] else "made")
    shutil.rmtree(folder / _WORK, ignore_errors=True)
    return CampaignResult(folder, len(kept) - sum(kept), sum(kept), messages, simulated)


def write_bag(batches: list[Batch], bag: Path) -> None:
    """Writes a bag with its messages in the order of their arrival; the bag appears whole or not at all."""
    work = bag.parent / _WORK / bag.name
    shutil.rmtree(work, ignore_errors=True)
    try:
        _write(batches, work)
    except OSError:
        shutil.rmtree(work.parent, ignore_errors=True)  # on a full disk it would only be in the way
        raise
    shutil.rmtree(bag, ignore_errors=True)
    work.rename(bag)


def _write(batches: list[Batch], work: Path) -> None:
    store = typestore()
    with BagWriter(work) as writer:
        streams = [
            Stream(
                writer.add_connection(
                    batch.topic, batch.msgtype, typestore=store, offered_qos_profiles=[offered_qos(batch.depth)]
                ).id,
                batch.log_ns,
                batch.rows,
            )
            for batch in batches
        ]
        for block in interleave(streams):
            writer.write_block(block)


def _span(batches: list[Batch]) -> float:
    times = [batch.log_ns for batch in batches if batch.log_ns.size]
    return float(max(t[-1] for t in times) - min(t[0] for t in times)) * 1e-9


def _tell(progress: Progress | None, number: int, run: PlanRun, what: str) -> None:
    if progress is not None:
        progress(number, run, what)


def _open_folder(plan: Plan, folder: Path, spec: SessionSpec) -> Index:
    """A new folder with nothing done, or the index of an equal campaign that was begun there."""
    index = Index.of_plan(plan, spec.unit_name)
    truth = _truth(spec)
    if folder.exists() and not folder.is_dir():
        raise SimulateError(f"{folder}: is a file; give a folder")
    begun = {TRUTH, f"{TRUTH}.tmp", f"{INDEX}.tmp"}  # what is left where it was killed before its first run
    if not folder.exists() or all(entry.name in begun for entry in folder.iterdir()):
        folder.mkdir(parents=True, exist_ok=True)
        write_yaml(folder / TRUTH, truth)
        index.write(folder)
        return index
    if not (folder / INDEX).is_file() or not (folder / TRUTH).is_file():
        raise SimulateError(f"{folder}: is not empty and holds no simulated campaign; give another folder")
    found = read_index(folder)
    if _read(folder / TRUTH) != truth or not found.same_plan(index):
        raise SimulateError(f"{folder}: holds a campaign of another plan, seed or effect; give another folder")
    return found


def _read(path: Path) -> Any:
    try:
        return parse_yaml(path.read_text(encoding="utf-8"))
    except ValueError as error:
        raise SimulateError(f"{path}: {error}; give another folder") from error


def _truth(spec: SessionSpec) -> dict[str, Any]:
    """What the index does not tell."""
    unit = UnitParameters.draw(spec.unit)
    return {
        "schema": TRUTH_SCHEMA,
        "seed": spec.seed,
        "unit_seed": spec.unit,
        "start_time": spec.start_time,
        **({"ndof": True} if spec.ndof else {}),
        "effects": {effect.name: effect.value for effect in parse_effects(spec.effects)},
        "mpu6050": {
            "bias": unit.mpu_gyro.bias.tolist(),
            "g_sensitivity": unit.mpu_gyro.g_sensitivity.tolist(),
            "unit": "rad/s, (rad/s)/(m/s^2); before effects that replace them",
        },
    }
