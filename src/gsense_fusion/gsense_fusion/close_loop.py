"""`close_loop`: from bags to the verdict, the report and the compensation file; `--compare`: what changed."""

from __future__ import annotations

import argparse
import importlib.util
import inspect
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from gsense_fusion.bags import load_run
from gsense_fusion.bags.run import Run
from gsense_fusion.cli import add_bag_arguments, guarded, roles
from gsense_fusion.comparison.command import compare_paths
from gsense_fusion.compensation.document import write_atomically
from gsense_fusion.compensation.model import write_compensation
from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.earth import Site
from gsense_fusion.identification.effects.base import Effect
from gsense_fusion.identification.engine import Settings, close_loop
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import IdentificationError, Role
from gsense_fusion.report.document import report_json
from gsense_fusion.report.html import report_html
from gsense_fusion.report.outputs import compensation, next_plan
from gsense_fusion.report.words import one_sentence


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code: 0 whatever the verdict, 2 for unusable input (one line on stderr)."""
    parser = _parser()
    arguments = parser.parse_args(argv)
    if arguments.compare is not None:
        if arguments.fit or arguments.held_out:
            parser.error("--compare takes two reports or campaigns; it does not go with --fit and --held-out")
        return _compare(arguments)
    if not arguments.fit or arguments.out is None:
        parser.error("--fit and --out are needed (or --compare OLD NEW)")

    def work() -> None:
        result = _run(arguments, roles(arguments.fit, arguments.held_out))
        written = write_files(result, arguments.out)
        print(one_sentence(result))
        for path in written:
            print(path)

    return guarded("close_loop", arguments.fit[0], arguments.out, work)


def _compare(arguments: argparse.Namespace) -> int:
    old, new = arguments.compare

    def work() -> None:
        console = Console(width=None if sys.stdout.isatty() else 200)
        for path in compare_paths(old, new, arguments.out, lambda bags: _run(arguments, bags), console):
            print(path)

    return guarded("close_loop", new, arguments.out or old, work)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="close_loop",
        description="Find what the declared gyro model lacks; show the error before and after on runs not fitted.",
    )
    add_bag_arguments(parser, required=False)
    parser.add_argument(
        "--compare",
        nargs=2,
        type=Path,
        metavar=("OLD", "NEW"),
        help="what changed between two reports (folder or report.json) or campaigns (folder with index.yaml or bags)",
    )
    parser.add_argument("--sensor", default="mpu6050", help="a sensor's name or a whole topic (default: mpu6050)")
    parser.add_argument(
        "--declared", nargs="+", default=["bias", "g_sensitivity"], metavar="EFFECT", help="effects that the model has"
    )
    parser.add_argument("--effects", type=Path, metavar="FILE.py", help="a file with effects of your own")
    parser.add_argument("--latitude", type=float, metavar="DEG", help="of the rig: earth rate is then subtracted")
    parser.add_argument(
        "--rail-azimuth", type=float, metavar="DEG", help="of the rail's positive direction, from north over east"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the report")
    return parser


def _run(arguments: argparse.Namespace, bags: Sequence[tuple[Path, Role]]) -> LoopResult:
    own = [] if arguments.effects is None else own_effects(arguments.effects)
    replaced = {effect.name for effect in own}
    catalogue = (*own, *(e for e in CATALOGUE if e.name not in replaced))
    settings = Settings(arguments.sensor, tuple(arguments.declared), catalogue, _site(arguments))
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("reading bags", total=1.0)
        runs: list[tuple[Run, Role]] = []
        for number, (path, role) in enumerate(bags):
            progress.update(task, description=f"reading {path.name}", completed=0.3 * number / len(bags))
            runs.append((load_run(path, arguments.sensor), role))
        return close_loop(
            runs, settings, lambda text, part: progress.update(task, description=text, completed=0.3 + 0.7 * part)
        )


def _site(arguments: argparse.Namespace) -> Site | None:
    given = (arguments.latitude is not None, arguments.rail_azimuth is not None)
    if given == (False, False):
        return None
    if given != (True, True):
        raise IdentificationError("--latitude and --rail-azimuth belong together: give both or neither")
    if not -90.0 <= arguments.latitude <= 90.0:
        raise IdentificationError(f"--latitude {arguments.latitude:g}: degrees from -90 to 90")
    return Site(arguments.latitude, arguments.rail_azimuth)


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


def write_files(result: LoopResult, out: Path) -> list[Path]:
    """Write all files into a folder, each complete or not at all; returns their paths."""
    out.mkdir(parents=True, exist_ok=True)
    written = [out / "report.json", out / "report.html", out / "compensation.yaml"]
    write_atomically(written[0], report_json(result))
    write_atomically(written[1], report_html(result))
    write_compensation(written[2], compensation(result))
    plan = next_plan(result)
    path = out / "next_plan.yaml"
    if plan is None:
        path.unlink(missing_ok=True)  # one of an earlier analysis would mislead
    else:
        write_atomically(path, plan)
        written.append(path)
    return written


if __name__ == "__main__":
    sys.exit(main())
