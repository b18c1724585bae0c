"""`close_loop`: from bags to verdict, report and compensation file; `--compare`: what changed; `--manifest`: many."""

from __future__ import annotations

import argparse
import gc
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from gsense_driver.user_input.arguments import ArgumentParser
from gsense_fusion.cli import add_bag_arguments, guarded, named_roles
from gsense_fusion.closing import Request, result_files, run_request, write_files
from gsense_fusion.comparison.command import compare_paths
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import Role
from gsense_fusion.many.command import Options, run_many
from gsense_fusion.many.manifest import Choices
from gsense_fusion.report.words import one_sentence

BAGS = "--campaign, --fit and --held-out"


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; returns the exit code: 0 whatever the verdict, 2 for unusable input (one line on stderr)."""
    parser = _parser()
    arguments = parser.parse_args(argv)
    named = [*arguments.campaign, *arguments.fit, *arguments.held_out]
    if arguments.compare is not None:
        if named:
            parser.error(f"--compare takes two reports or campaigns; it does not go with {BAGS}")
        return _compare(arguments)
    if arguments.manifest is not None:
        if named or arguments.out is None:
            parser.error(f"--manifest names the bags itself: it needs --out, and does not go with {BAGS}")
        return run_many(_many(arguments), Console(highlight=False))
    if arguments.jobs or arguments.scheduler:
        parser.error("--jobs and --scheduler go with --manifest")
    if not (arguments.campaign or arguments.fit) or arguments.out is None:
        parser.error("--campaign or --fit, and --out are needed (or --compare OLD NEW, or --manifest FILE)")

    def work() -> None:
        result = _run(arguments, named_roles(arguments))
        written = write_files(result_files(result), arguments.out)
        print(one_sentence(result))
        for path in written:
            print(path)

    gc.freeze()  # what is loaded by now stays to the end: no collection need look through it
    return guarded("close_loop", named[0], arguments.out, work)


def _compare(arguments: argparse.Namespace) -> int:
    old, new = arguments.compare

    def work() -> None:
        console = Console(width=None if sys.stdout.isatty() else 200)
        for path in compare_paths(old, new, arguments.out, lambda bags: _run(arguments, bags), console):
            print(path)

    return guarded("close_loop", new, arguments.out or old, work)


def _parser() -> argparse.ArgumentParser:
    parser = ArgumentParser(
        prog="close_loop",
        description="Find what the declared gyro model lacks; show the error before and after on runs not fitted.",
    )
    add_bag_arguments(parser)
    parser.add_argument(
        "--compare",
        nargs=2,
        type=Path,
        metavar=("OLD", "NEW"),
        help="what changed between two reports (folder or report.json) or campaigns (folder with index.yaml or bags)",
    )
    parser.add_argument("--manifest", type=Path, metavar="FILE", help="many sessions at once, and a page over all")
    parser.add_argument("--jobs", type=_positive, metavar="N", help="with --manifest: processes (default: one a core)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="with --manifest: a Dask cluster's, tcp://HOST:8786")
    parser.add_argument("--sensor", default="mpu6050", help="a sensor's name or a whole topic (default: mpu6050)")
    parser.add_argument(
        "--declared",
        nargs="+",
        default=["bias", "g_sensitivity"],
        metavar="EFFECT",
        help="effects that the model has (default: bias g_sensitivity)",
    )
    parser.add_argument("--effects", type=Path, metavar="FILE.py", help="a file with effects of your own")
    parser.add_argument("--latitude", type=float, metavar="DEG", help="of the rig: earth rate is then subtracted")
    parser.add_argument(
        "--rail-azimuth", type=float, metavar="DEG", help="of the rail's positive direction, from north over east"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the report")
    return parser


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{value}: 1 or more")
    return value


def _many(arguments: argparse.Namespace) -> Options:
    choices = Choices(
        arguments.sensor, tuple(arguments.declared), arguments.effects, arguments.latitude, arguments.rail_azimuth
    )
    return Options(arguments.manifest, arguments.out, choices, arguments.jobs, arguments.scheduler)


def _run(arguments: argparse.Namespace, bags: Sequence[tuple[Path, Role]]) -> LoopResult:
    columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    screen = Console(stderr=True)
    with Progress(*columns, console=screen, transient=True, disable=not screen.is_terminal) as progress:
        task = progress.add_task("reading bags", total=1.0)
        result, _ = run_request(
            request(arguments, bags), lambda text, part: progress.update(task, description=text, completed=part)
        )
    return result


def request(arguments: argparse.Namespace, bags: Sequence[tuple[Path, Role]]) -> Request:
    """What the command line asks for these bags."""
    return Request(
        tuple(bags),
        arguments.sensor,
        tuple(arguments.declared),
        arguments.effects,
        arguments.latitude,
        arguments.rail_azimuth,
    )


if __name__ == "__main__":
    sys.exit(main())
