"""The end of the demonstration, on stdout: what was hidden beside what was found, errors before and after, files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from rich import box
from rich.console import Console
from rich.table import Table

from gsense_rig.demonstration.folder import DemoFolder
from gsense_rig.demonstration.hidden import HiddenEffect
from gsense_rig.demonstration.orientation import LiveErrors
from gsense_rig.demonstration.outcome import Outcome

DEG = 180.0 / math.pi
WIDTH = 110


@dataclass(frozen=True)
class Telling:
    """All that is told."""

    outcome: Outcome
    hidden: HiddenEffect
    sentence: str
    errors: LiveErrors
    figures: Mapping[str, Any]
    folder: DemoFolder


def reveal(told: Telling) -> None:
    """Prints it; the last lines name the files."""
    console = Console(highlight=False)
    if not console.is_terminal:
        console = Console(highlight=False, width=WIDTH)
    console.print()
    console.print(f"[bold]The hidden effect was {told.hidden.kind.name}.[/] {_judgement(told.outcome)}")
    console.print(_comparison(told.outcome))
    console.print(_errors(told.outcome, told.errors))
    if told.errors.less_reference is not None:
        console.print("The rail's turning is true rotation: the gyro is right to show it, so it is not compensated.")
    if told.sentence:
        console.print(told.sentence, markup=False)
    wall, whole = told.figures["wall_s"], told.figures["wall_since_command_s"]
    setup = f" ({whole - wall:.0f} s of set-up before)" if whole - wall > 5.0 else ""
    console.print(f"Done in {wall:.0f} s{setup}. Files:")
    for path in files(told.folder):
        console.print(f"  {path}", markup=False, soft_wrap=True)


def files(folder: DemoFolder) -> list[str]:
    """What was written, what a person wants first at the end."""
    report = folder.report
    paths = [folder.live_bag, folder.campaign / "index.yaml", folder.hidden, folder.summary]
    names = ("undecided_plan.yaml", "next_plan.yaml", "compensation.yaml", "report.json", "report.html")
    paths += [report / name for name in names]
    return [str(path) for path in paths if path.exists()]


def _judgement(outcome: Outcome) -> str:
    if not outcome.hidden_found:
        return "[red]The loop did not name it.[/]"
    near = "" if outcome.deviation is None else f", off by at most {outcome.deviation:.1f} standard errors"
    more = f", and named {', '.join(outcome.others)} as well" if outcome.others else ""
    return f"[green]The loop named it[/]{near}{more}."


def _comparison(outcome: Outcome) -> Table:
    table = Table(box=box.SIMPLE, title="hidden and found", title_justify="left", show_edge=False)
    for name in ("effect", "parameter", "hidden", "found +- 1 sigma", "unit"):
        table.add_column(name, justify="right" if name.startswith(("hidden", "found")) else "left")
    for row in outcome.rows:
        table.add_row(row.effect, row.parameter, row.hidden, row.found, row.unit)
    return table


def _errors(outcome: Outcome, live: LiveErrors) -> Table:
    rate, before, after = outcome.rate_rms, live.before, live.after
    table = Table(box=box.SIMPLE, title="error before and after", title_justify="left", show_edge=False)
    table.add_column("")
    for name in ("bias alone", "declared model", "with findings", "noise floor", "unit"):
        table.add_column(name, justify="left" if name == "unit" else "right")
    held_out = [f"{rate[name] * DEG:.4f}" for name in ("raw", "declared", "full", "noise_floor")]
    table.add_row("held-out runs, rate below 5 Hz", *held_out, "deg/s rms")
    table.add_row("live, rate below 5 Hz", f"{before.rate * DEG:.4f}", "", f"{after.rate * DEG:.4f}", "", "deg/s rms")
    if live.less_reference is not None:
        table.add_row("live, less the rail's turning", "", "", f"{live.less_reference * DEG:.4f}", "", "deg/s rms")
    table.add_row("live, tilt of madgwick", f"{before.tilt * DEG:.3f}", "", f"{after.tilt * DEG:.3f}", "", "deg rms")
    return table
