"""`campaign PLAN --out DIR [--yes]`: the runs of a plan on the live rig.

Uses the nodes that are running: rig, bridge (and what else publishes). With --yes the rig must be simulated; where none
is running, the simulated graph is started, and ended at the end. `--ros-args -r __ns:=/a` is the rig in namespace /a.
"""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from rclpy.exceptions import ParameterException
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from gsense_driver.user_input.arguments import ArgumentParser, without_ros
from gsense_driver.user_input.interruption import Interrupted, Interruption
from gsense_rig.campaign.crew import CampaignError
from gsense_rig.campaign.index import INDEX, CampaignIndexError
from gsense_rig.campaign.live import Limits, LiveCampaign, LiveResult, Step
from gsense_rig.campaign.live_rig import LiveRig
from gsense_rig.campaign.operators import Person, SimulatedPerson
from gsense_rig.campaign.plan import PlanError, load_plan, shipped_plans
from gsense_rig.campaign.simulated_graph import SimulatedGraph
from gsense_rig.recording.typestore import DefinitionError

UNUSABLE, STOPPED, INTERRUPTED = 2, 1, 130
_LISTEN = 5.0
"""s in which a running rig is heard."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Exit 0; 2 with one line where plan or folder cannot be used; 1 where it stopped; 130 after Ctrl-C."""
    options = _parser().parse_args(without_ros("campaign", sys.argv if arguments is None else ["campaign", *arguments]))
    asked = Interruption()
    begun = False
    try:
        plan = load_plan(options.plan)
        with ExitStack() as stack:
            rig = _crew(options, stack)
            bar = Bar(len(plan.runs))
            stack.callback(bar.close)
            rig.operator = rig.operator or Person(bar.ask)
            begun = True
            result = LiveCampaign(
                plan,
                options.out,
                rig,
                seed=None if options.order == "plan" else options.seed,
                limits=Limits(loss=options.max_loss),
                progress=bar.show,
            ).run()
    except (PlanError, CampaignIndexError, DefinitionError, ParameterException) as error:
        return _say(str(error), UNUSABLE)
    except (CampaignError, OSError) as error:
        goes_on = begun and (options.out / INDEX).is_file()
        return _say(f"{error}{'; the same command goes on' if goes_on else ''}", STOPPED if goes_on else UNUSABLE)
    except (Interrupted, Exception):
        if asked.number is None:  # else it is what a binding of ROS made of the exception that it was interrupted by
            raise
        return _say(f"interrupted; the same command goes on in {options.out}", INTERRUPTED)
    _report(result)
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = ArgumentParser(prog="campaign", description=__doc__)
    parser.add_argument("plan", metavar="PLAN", help=f"a YAML file, or a shipped plan: {', '.join(shipped_plans())}")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="where bags and index.yaml go")
    parser.add_argument(
        "--yes", action="store_true", help="simulated rig: nobody is asked, the simulation turns the board"
    )
    parser.add_argument("--order", choices=("random", "plan"), default="random", help="of the runs (default random)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="draws the order (default 1)")
    parser.add_argument(
        "--max-loss", type=float, default=Limits.loss, metavar="X", help="share of lost frames that is borne (0.001)"
    )
    parser.add_argument(
        "--effect", action="append", default=[], metavar="NAME=VALUE", help="of a simulated board that this starts"
    )
    return parser


def _crew(options: argparse.Namespace, stack: ExitStack) -> LiveRig:
    """The running rig; with --yes, where there is none, a simulated one."""
    graphs: list[SimulatedGraph] = []

    def check() -> None:
        for graph in graphs:
            graph.check()

    rig = LiveRig(check)
    stack.callback(rig.close)
    if not options.yes:
        return rig
    if not rig.hears_rig(_LISTEN):
        folder = Path(tempfile.mkdtemp(prefix="gsense-campaign-"))
        graphs.append(SimulatedGraph(folder, tuple(options.effect), namespace=rig.node.get_namespace()))
        stack.callback(shutil.rmtree, folder, ignore_errors=True)
        stack.callback(graphs[0].close)
        Console(stderr=True).print("no rig is running: a simulated one was started", highlight=False)
    elif options.effect:
        raise PlanError("--effect is for a simulated rig that this command starts; one is running already")
    rig.hears_rig(6 * _LISTEN)
    operator = SimulatedPerson(rig)
    operator.check()
    rig.operator = operator
    return rig


class Bar:
    """Progress with the time that is left, on stderr; a line for each run where nothing can be drawn."""

    def __init__(self, total: int, console: Console | None = None) -> None:
        self._console = console or Console(stderr=True)
        self._draws = self._console.is_terminal and not self._console.is_dumb_terminal
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), _Left())
        self._progress = Progress(*columns, console=self._console, transient=True)
        self._task = self._progress.add_task("", total=total, end=None)
        self._told = ""
        self._end = 0.0
        if self._draws:
            self._progress.start()

    def close(self) -> None:
        """Takes the bar away."""
        if self._progress.live.is_started:
            self._progress.stop()

    def show(self, step: Step) -> None:
        """Where the campaign is."""
        run = step.run
        motion = run.shape if run.shape == "static" else f"{run.shape} {run.angular_frequency:g} rad/s"
        text = f"run_{step.number:02d} of {step.total}: {motion}, mounting {run.mounting}"
        if text != self._told:
            self._end = time.monotonic() + step.remaining
        if self._draws:
            self._told = text
            what = f"{text}, {step.what}"
            self._progress.update(self._task, completed=step.number, description=what, end=self._end)
        elif self._told != text or step.what.startswith("again"):
            self._told = text
            left = _minutes(step.remaining)
            self._console.print(f"{text}, {step.what}; {left}", highlight=False, soft_wrap=True)

    def ask(self, question: str) -> None:
        """A question, and its answer; raises EOFError where nobody is there."""
        if not sys.stdin.isatty():
            raise EOFError
        self.close()
        self._console.input(question)
        if self._draws:
            self._progress.start()


class _Left(ProgressColumn):
    """The time that is left, counted down."""

    def render(self, task: Task) -> Text:
        """Minutes and seconds; nothing before the first run."""
        end = task.fields["end"]
        return Text("" if end is None else _minutes(end - time.monotonic()))


def _minutes(seconds: float) -> str:
    whole = max(0, round(seconds))
    return f"{whole // 60}:{whole % 60:02d} left"


def _report(result: LiveResult) -> None:
    kept = f", {result.kept} were there already" if result.kept else ""
    console = Console(highlight=False, soft_wrap=True)
    console.print(f"{result.made} runs{kept}; {result.lost} of {result.frames + result.lost} frames lost")
    console.print(str(result.folder / INDEX))


def _say(text: str, code: int) -> int:
    Console(stderr=True, highlight=False, soft_wrap=True, markup=False).print(f"campaign: {text}")
    return code


if __name__ == "__main__":
    sys.exit(main())
