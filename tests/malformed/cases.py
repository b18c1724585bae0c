"""Malformed inputs by number: what is written, and which command gets it."""

from __future__ import annotations

import contextlib
import io
import json
import os
import random
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rosbags.rosbag2 import StoragePlugin
from tests.fusion.bag_data import rail_bag as short_bag
from tests.fusion.comparison import reports
from tests.malformed.answers import Verdict, answer, in_its_own, in_this_process
from tests.malformed.corruption import TEXTS, spoil_bytes, spoil_document, spoil_text, spoil_yaml
from tests.malformed.wrong_bags import KINDS, write_wrong

from gsense_fusion.report.document import report_json
from gsense_rig import simulate

HERE = Path(__file__).resolve().parent
PLAN = """runs:
  - {shape: static, duration: 2.0, position: 0.0, mounting: "0", role: fit}
  - {shape: sine, amplitude: 0.05, angular_frequency: 8.0, duration: 1.0, mounting: "180", role: held_out}
"""
MANIFEST = """entries:
  - {campaign: "nowhere_*", sensor: mpu6050, name: a}
  - {fit: [no_bag], held_out: [no_other], declared: [bias], latitude: 49.2, rail_azimuth: 30.0, unit_id: A7, name: b}
"""
COMPENSATION = (HERE.parent / "bags" / "compensation.yaml").read_text(encoding="utf-8")
FULL_COMPENSATION = """schema: gsense-compensation/1
sensor: mpu6050
unit_id: A7
bias: {value: [0.01, 0.0, 0.0], unit: rad/s}
terms:
- {effect: temperature_bias, c: [1.0e-4, 0.0, 0.0], T0: 25.0, lag_s: 3.0}
timing: {gyro_delay_s: 0.01}
reference:
- {effect: rail_curvature, t: [0.0, 0.001, 0.0]}
accelerometer: {matrix: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], bias: [0.0, 0.0, 0.0], unit: m/s^2}
magnetometer: {hard_iron: [0.0, 0.0, 0.0], soft_iron: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], unit: T}
"""
EFFECTS = "from gsense_fusion.identification.effects.base import Effect\n\n\nclass Mine(Effect):\n    name = 'mine'\n"


@dataclass(frozen=True)
class Material:
    """Sound files to spoil, made once."""

    folder: Path

    @classmethod
    def make(cls, folder: Path) -> Material:
        """Bags of either storage, compressed ones, a simulated campaign, a report."""
        folder.mkdir(parents=True, exist_ok=True)
        short_bag(count=600).write(folder / "mcap")
        short_bag(count=600).write(folder / "sqlite", StoragePlugin.SQLITE3)
        short_bag(count=600).write(folder / "packed", compression="file")
        shutil.copytree(folder / "mcap", folder / "killed")
        (folder / "killed" / "metadata.yaml").unlink()
        for file in (folder / "killed").iterdir():
            file.write_bytes(file.read_bytes()[:-400])
        (folder / "plan.yaml").write_text(PLAN)
        with contextlib.redirect_stdout(io.StringIO()):
            assert simulate.main([str(folder / "plan.yaml"), "--out", str(folder / "campaign")]) == 0
        (folder / "report.json").write_text(report_json(reports.result(1)))
        return cls(folder)


Maker = Callable[[Material, Path, random.Random], tuple[str, list[str]]]
"""Writes a case's files into a folder; returns what it is and the command with its arguments, without --out."""


def spoilt_bag(material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    name = draw.choice(("mcap", "mcap", "sqlite", "packed", "killed"))
    bag = folder / "bag"
    shutil.copytree(material.folder / name, bag)
    metadata = bag / "metadata.yaml"
    files = sorted(p for p in bag.iterdir() if p != metadata)
    kind = draw.randrange(10)
    if kind < 5:
        files[0].write_bytes(spoil_bytes(files[0].read_bytes(), draw))
        what = "storage"
    elif kind < 8 and metadata.exists():
        metadata.write_bytes(spoil_yaml(metadata.read_text(), draw))
        what = "metadata.yaml"
    else:
        what = draw.choice(ODD_FILES)
        _odd(draw.choice(files), what, draw)
    return f"{name} bag, {what}", _bag_command(bag, draw)


ODD_FILES = ("missing", "empty", "random", "folder", "dangling link", "pipe", "no metadata", "text")


def _odd(path: Path, what: str, draw: random.Random) -> None:
    """Something else in the place of a file."""
    if what == "no metadata":
        (path.parent / "metadata.yaml").unlink(missing_ok=True)
        return
    path.unlink()
    if what == "empty":
        path.write_bytes(b"")
    elif what == "random":
        path.write_bytes(draw.randbytes(5000))
    elif what == "folder":
        path.mkdir()
    elif what == "dangling link":
        path.symlink_to("nowhere")
    elif what == "pipe":
        os.mkfifo(path)
    elif what == "text":
        path.write_bytes(draw.choice(TEXTS))


def wrong_bag(_material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    kind = draw.choice(KINDS)
    write_wrong(folder / "bag", kind, draw)
    return f"whole bag, {kind}", _bag_command(folder / "bag", draw)


def _bag_command(bag: Path, draw: random.Random) -> list[str]:
    name = draw.choice(("close_loop", "close_loop", "calibrate", "replay"))
    if name == "replay":
        return [name, str(bag), *(["--filters", "madgwick"] if draw.random() < 0.5 else [])]
    return [name, "--fit", str(bag)]


def no_bag(material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    paths = {
        "missing": folder / "nowhere",
        "empty folder": folder / "empty",
        "text file": folder / "text.txt",
        "two bags": material.folder,
        "device": Path("/dev/null"),
        "long name": folder / ("x" * 300),
    }
    paths["empty folder"].mkdir()
    paths["text file"].write_text("x")
    what = draw.choice(sorted(paths))
    return f"no bag: {what}", _bag_command(paths[what], draw)


def plan(_material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    path = folder / "plan.yaml"
    path.write_bytes(spoil_yaml(PLAN, draw))
    return "plan", ["simulate", str(path)]


def index(material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    out = folder / "out"
    shutil.copytree(material.folder / "campaign", out)
    file = out / draw.choice(("index.yaml", "index.yaml", "truth.yaml"))
    file.write_bytes(spoil_yaml(file.read_text(), draw))
    return file.name, ["simulate", str(material.folder / "plan.yaml")]


def compensation(material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    path = folder / "compensation.yaml"
    path.write_bytes(spoil_yaml(draw.choice((COMPENSATION, FULL_COMPENSATION)), draw))
    if draw.random() < 0.2:
        return "compensation", ["replay", str(material.folder / "mcap"), "--no-bag", "--compensation", str(path)]
    return "compensation", ["load_compensation", str(path)]


def manifest(material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    path = folder / "all.yaml"
    if draw.random() < 0.3:  # an index that is named by a sound manifest
        shutil.copytree(material.folder / "campaign", folder / "campaign")
        spoilt = folder / "campaign" / "index.yaml"
        spoilt.write_bytes(spoil_yaml(spoilt.read_text(), draw))
        (folder / "campaign" / "run_00" / "metadata.yaml").write_text("spoilt: too\n")
        path.write_text("entries: [{campaign: campaign}]\n")
        return "index of a manifest", ["many", str(path)]
    path.write_bytes(spoil_yaml(MANIFEST, draw))
    return "manifest", ["many", str(path)]


def report(material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    text = (material.folder / "report.json").read_text()
    spoilt = folder / "report.json"
    if draw.random() < 0.3:
        spoilt.write_bytes(spoil_text(text, draw))
    else:
        spoilt.write_text(json.dumps(spoil_document(json.loads(text), draw)))
    return "report", ["close_loop", "--compare", str(material.folder / "report.json"), str(spoilt)]


def effects(material: Material, folder: Path, draw: random.Random) -> tuple[str, list[str]]:
    path = folder / "mine.py"
    path.write_bytes(spoil_text(EFFECTS, draw))
    return "effects file", ["close_loop", "--fit", str(material.folder / "mcap"), "--effects", str(path)]


MAKERS: tuple[tuple[Maker, int], ...] = (
    (spoilt_bag, 36),
    (wrong_bag, 20),
    (no_bag, 3),
    (plan, 10),
    (index, 5),
    (compensation, 10),
    (manifest, 8),
    (report, 6),
    (effects, 2),
)
"""Each kind of case with its share, %."""


def run_case(number: int, seed: int, material: Material, folder: Path, *, as_process: bool = False) -> Verdict:
    """Make a case, answer it in this process or in one of its own, judge the answer; `folder` is removed at the end."""
    draw = random.Random(seed * 1_000_003 + number)
    folder.mkdir()
    try:
        maker = draw.choices([m for m, _ in MAKERS], [share for _, share in MAKERS])[0]
        what, command = maker(material, folder, draw)
        verdict = Verdict(number, what, command)
        answer(verdict, folder / "out", in_its_own if as_process else in_this_process)
        return verdict
    finally:
        shutil.rmtree(folder, ignore_errors=True)
