"""One closing of the loop: what is asked, its bags read and analysed, and the files that say what was found."""

from __future__ import annotations

import importlib.util
import inspect
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from gsense_fusion.bags import load_run
from gsense_fusion.bags.run import Run
from gsense_fusion.compensation.document import write_together
from gsense_fusion.compensation.model import compensation_yaml
from gsense_fusion.identification.analysis import Progress
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.engine import Settings, close_loop
from gsense_fusion.identification.motion.earth import Site
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import IdentificationError, Role
from gsense_fusion.report.document import report_json
from gsense_fusion.report.html import report_html
from gsense_fusion.report.next_plan import next_plan, undecided_plan
from gsense_fusion.report.outputs import compensation

REPORT_JSON, REPORT_HTML, COMPENSATION = "report.json", "report.html", "compensation.yaml"
NEXT_PLAN, UNDECIDED_PLAN = "next_plan.yaml", "undecided_plan.yaml"
READING = 0.3
"""Part of the progress that reading is."""


@dataclass(frozen=True)
class Request:
    """What is to be analysed, and how."""

    bags: tuple[tuple[Path, Role], ...]
    sensor: str = "mpu6050"
    """A sensor's name or a whole topic."""
    declared: tuple[str, ...] = ("bias", "g_sensitivity")
    effects: Path | None = None
    """A Python file with effects of the user's own."""
    latitude: float | None = None
    """Of the rig, degrees."""
    rail_azimuth: float | None = None
    """Of the rail's positive direction, degrees from north over east."""


def run_request(request: Request, progress: Progress) -> tuple[LoopResult, list[Run]]:
    """Read the bags and close the loop; returns what was found and the runs.

    Raises:
        BagError, IdentificationError: the input is unusable; one line.
    """
    settings = _settings(request)
    runs: list[tuple[Run, Role]] = []
    for number, (path, role) in enumerate(request.bags):
        progress(f"reading {path.name}", READING * number / len(request.bags))
        runs.append((load_run(path, request.sensor), role))
    result = close_loop(runs, settings, lambda text, part: progress(text, READING + (1.0 - READING) * part))
    return result, [run for run, _ in runs]


def _settings(request: Request) -> Settings:
    own = [] if request.effects is None else own_effects(request.effects)
    replaced = {effect.name for effect in own}
    catalogue = (*own, *(e for e in CATALOGUE if e.name not in replaced))
    return Settings(request.sensor, request.declared, catalogue, _site(request))


def _site(request: Request) -> Site | None:
    if request.latitude is None and request.rail_azimuth is None:
        return None
    if request.latitude is None or request.rail_azimuth is None:
        raise IdentificationError("--latitude and --rail-azimuth belong together: give both or neither")
    if not -90.0 <= request.latitude <= 90.0:
        raise IdentificationError(f"--latitude {request.latitude:g}: degrees from -90 to 90")
    return Site(request.latitude, request.rail_azimuth)


def own_effects(path: Path) -> list[Effect]:
    """Effects from a user's file: every concrete subclass of Effect that it defines.

    Raises:
        IdentificationError: The file cannot be loaded or has no effect.

    """
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise IdentificationError(f"{path}: not a Python file with effects")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise IdentificationError(f"{path}: {type(error).__name__}: {error}") from error
    kinds = [
        c
        for c in vars(module).values()
        if inspect.isclass(c)
        and issubclass(c, Effect)
        and not inspect.isabstract(c)
        and c.__module__ == module.__name__
    ]
    if not kinds:
        raise IdentificationError(f"{path}: defines no subclass of gsense_fusion.identification.effects.base.Effect")
    return [kind() for kind in kinds]


def result_files(result: LoopResult) -> dict[str, str | None]:
    """The files of a report by name; None for one that this result does not have."""
    return {
        REPORT_JSON: report_json(result),
        REPORT_HTML: report_html(result),
        COMPENSATION: compensation_yaml(compensation(result)),
        NEXT_PLAN: next_plan(result),
        UNDECIDED_PLAN: undecided_plan(result),
    }


def write_files(files: Mapping[str, str | None], out: Path) -> list[Path]:
    """Write all files into a folder, all of them or none; returns their paths."""
    out.mkdir(parents=True, exist_ok=True)
    texts = {name: text for name, text in files.items() if text is not None}
    write_together(out, texts)
    for name in files.keys() - texts.keys():
        (out / name).unlink(missing_ok=True)  # one of an earlier analysis would mislead
    return [out / name for name in texts]
