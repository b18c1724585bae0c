"""next_plan.yaml from a result: the runs that separate rivals, and those that decide what these runs left open.

Where there are no rivals, the latter are a plan of their own, undecided_plan.yaml.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import yaml

from gsense_fusion.identification.catalogue import CATALOGUE
from gsense_fusion.identification.result import LoopResult
from gsense_fusion.identification.types import Owner

SEPARATING_RUNS: dict[str, list[dict[str, Any]]] = {
    "board_turned_180": [
        {"shape": "sine", "amplitude": 0.15, "angular_frequency": w, "duration": 24.0, "mounting": 180, "role": r}
        for w, r in ((3.0, "fit"), (5.0, "held_out"), (6.0, "fit"), (8.0, "fit"))
    ],
    "board_turned_90": [
        {"shape": "sine", "amplitude": 0.15, "angular_frequency": w, "duration": 24.0, "mounting": 90, "role": "fit"}
        for w in (4.0, 6.0, 8.0)
    ],
    "temperature_soak": [{"shape": "static", "duration": 600.0, "mounting": 0, "position": 0.0, "role": "fit"}],
    "long_rest": [{"shape": "static", "duration": 7200.0, "mounting": 0, "position": 0.0, "role": "fit"}],
    "small_stroke": [
        {"shape": "sine", "amplitude": 0.05, "angular_frequency": w, "duration": 24.0, "mounting": 0, "role": "fit"}
        for w in (4.0, 6.0, 8.0)
    ],
}
"""Runs that separate rivals, by the name of the separating run; each plan begins with a run at rest."""
SEPARATING_RUNS["supply_toggled"] = [
    {"shape": "static", "duration": 240.0, "mounting": 0, "position": 0.0, "role": r} for r in ("fit", "held_out")
]
SEPARATING_RUNS["motor_beside_board"] = [
    {"shape": "sine", "amplitude": 0.15, "angular_frequency": w, "duration": 24.0, "mounting": 0, "role": "fit"}
    for w in (2.0, 4.0, 8.0)
]
BY_HAND = {
    "supply_toggled": "toggle the board's supply by 0.2 V every 30 s during the long rests",
    "motor_beside_board": "lay the board still beside the rail during the motion, as near to the motor as it was",
    "temperature_soak": "warm the board by 10 K and let it cool down during the long rest",
}
"""What a person does in a separating run that a plan cannot say."""
HOURS = ("long_rest",)
"""Too long to come in unasked beside others."""
REST: dict[str, Any] = {"shape": "static", "duration": 60.0, "mounting": 0, "position": 0.0, "role": "fit"}


def next_plan(result: LoopResult) -> str | None:
    """A plan for `campaign` that separates rivals and decides what else is open; None where no rivals remain."""
    return _plan(result) if _rivals(result) else None


def undecided_plan(result: LoopResult) -> str | None:
    """A plan for `campaign` that decides what is open, no rivals remaining; None where no campaign can."""
    return None if _rivals(result) else _plan(result)


def _rivals(result: LoopResult) -> dict[str, tuple[tuple[str, ...], str]]:
    """Findings with rivals that a run separates: in words, by name, and the run."""
    found = [f for f in result.findings if f.alternatives and f.separating_run in SEPARATING_RUNS]
    words = (f"{f.effect} or {', '.join(f.alternatives)}" for f in found)
    return {w: ((f.effect, *f.alternatives), str(f.separating_run)) for w, f in zip(words, found, strict=True)}


def _plan(result: LoopResult) -> str | None:
    """Rivals ask for every separating run.

    An effect that is only left open asks for those that the rig makes by itself in some minutes; its other ones stand
    in the plan's head.
    """
    rivals = _rivals(result)
    asked = list(rivals.values())
    taken = {run for _, run in asked}
    easy = {n: run for n, run in result.deciding_runs.items() if run in taken or run not in (*BY_HAND, *HOURS)}
    asked += [((n,), run) for n, run in easy.items() if run in SEPARATING_RUNS]
    if not asked:
        return None
    runs = [REST]
    for effects, name in asked:
        runs += [run for run in _separating_runs(effects, name) if run not in runs]
    head = [f"separates {'; '.join(rivals)}"] if rivals else []
    head += [f"decides {n}" for n in easy]
    head += [f"{n} is left open: {run} would decide" for n, run in result.deciding_runs.items() if n not in easy]
    head += [f"{name}: {text}" for name, text in BY_HAND.items() if name in taken]
    plan = yaml.safe_dump({"runs": runs}, sort_keys=False, default_flow_style=None)
    return "".join(f"# {line}\n" for line in head) + plan


def _separating_runs(effects: Sequence[str], name: str) -> list[dict[str, Any]]:
    """The runs that separate some effects.

    By 90 degrees about the vertical the force comes to another axis of the sensor, which may answer otherwise: where
    the rig may turn, the board is laid on its side instead, and the force keeps its axis.
    """
    runs = SEPARATING_RUNS[name]
    turning = {e.name for e in CATALOGUE if e.owner is Owner.RIG} & set(effects)
    if name == "board_turned_90" and turning:
        return [{**run, "mounting": "tilt_x"} for run in runs]
    return runs
