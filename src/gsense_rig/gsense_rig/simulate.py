"""`simulate PLAN --out DIR [--effect NAME=VALUE ...] [--seed N]`: the bags of a campaign, without ROS and real time."""

from __future__ import annotations

import argparse
import gc
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from gsense_driver.user_input.arguments import ArgumentParser
from gsense_driver.user_input.interruption import Interruption
from gsense_rig.campaign.index import CampaignIndexError
from gsense_rig.campaign.plan import Plan, PlanError, PlanRun, load_plan, shipped_plans
from gsense_rig.campaign.session import DEFAULT_START, SessionSpec
from gsense_rig.campaign.simulate import CampaignResult, SimulateError, simulate_campaign
from gsense_rig.recording.typestore import DefinitionError
from gsense_rig.sensors.effects import EFFECTS

UNUSABLE = 2


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit 0; 2 with one line on stderr where plan, effect or folder cannot be used; 130 after Ctrl-C."""
    gc.disable()  # arrays without cycles: the collector only looks at telemetry, over and over
    options = _parser().parse_args(arguments)
    spec = SessionSpec(
        options.seed, tuple(options.effect), options.unit_seed, options.start_time, options.unit_id, options.ndof
    )
    try:
        plan = load_plan(options.plan)
        begun = time.perf_counter()
        with Interruption():
            result = _simulate(plan, options.out, spec)
    except (PlanError, SimulateError, CampaignIndexError, DefinitionError, ValueError, OSError) as error:
        print(f"simulate: {error}", file=sys.stderr)
        return UNUSABLE
    except KeyboardInterrupt:
        print(f"simulate: interrupted; the same command goes on in {options.out}", file=sys.stderr)
        return 130
    _report(result, time.perf_counter() - begun)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = ArgumentParser(prog="simulate", description=__doc__)
    parser.add_argument("plan", metavar="PLAN", help=f"a YAML file, or a shipped plan: {', '.join(shipped_plans())}")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="where bags and index.yaml go")
    parser.add_argument(
        "--effect",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help=f"adds an undeclared effect, VALUE in SI; may be repeated. Names: {', '.join(sorted(EFFECTS))}",
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="repeats a session bit for bit (default 1)")
    parser.add_argument(
        "--unit-seed", type=int, metavar="N", help="draws the unit apart from the noise (default: as --seed)"
    )
    parser.add_argument(
        "--unit-id",
        metavar="TEXT",
        help="name of the unit in the bags (default: simulated- and the number that draws it)",
    )
    parser.add_argument(
        "--ndof",
        action="store_true",
        help="bno055/imu/data beside the raw topics: a stand-in for the chip's own fusion",
    )
    parser.add_argument(
        "--start-time", type=float, default=DEFAULT_START, metavar="S", help="s since 1970 (default 2026-01-01)"
    )
    return parser


def _simulate(plan: Plan, folder: Path, spec: SessionSpec) -> CampaignResult:
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(plan.name, total=len(plan.runs))

        def progress(number: int, run: PlanRun, what: str) -> None:
            motion = run.shape if run.shape == "static" else f"{run.shape} {run.angular_frequency:g} rad/s"
            bar.update(task, description=f"run {number}: {motion}", completed=number + (what != "begun"))

        return simulate_campaign(plan, folder, spec, progress)


def _report(result: CampaignResult, seconds: float) -> None:
    kept = f", {result.kept} were there already" if result.kept else ""
    speed = f", {result.simulated / seconds:.0f} times real time" if result.made else ""
    print(f"{result.made} runs, {result.simulated:.0f} s, {result.messages} messages in {seconds:.1f} s{speed}{kept}")
    print(result.folder / "index.yaml")


if __name__ == "__main__":
    sys.exit(main())
