"""The plan of a campaign: a list of runs, each with its motion, its mounting and its role.

A plan is YAML, a file or one that ships with the package. What is wrong in it is said in one line with file and entry.
"""

from __future__ import annotations

import math
import reprlib
from dataclasses import asdict, dataclass, fields
from importlib import resources
from pathlib import Path
from typing import Any

from gsense_driver.user_input.yaml_text import parse_yaml
from gsense_rig.control.triangle import triangle_is_possible
from gsense_rig.sensors.mounting import MOUNTINGS

SHAPES = ("sine", "triangle", "static")
ROLES = ("fit", "held_out")
SOFT_LIMIT = 0.22
"""m: the carriage's stroke to either side."""
FASTEST = 1.9
"""m/s: what the motor reaches on its supply, with some reserve."""
STRONGEST = 15.0
"""m/s^2: what the motor's current limit allows, with some reserve."""
LONGEST = 4 * 3600.0


class PlanError(ValueError):
    """A plan that cannot be run; the message is one line that names file and entry."""


@dataclass(frozen=True)
class PlanRun:
    """One run. `duration` is the time of the motion (or of the rest, for a static run), without the rests around it."""

    shape: str
    duration: float
    """s."""
    amplitude: float = 0.0
    """m."""
    angular_frequency: float = 0.0
    """rad/s."""
    mounting: str = "0"
    """How the board sits: `sensors.mounting.MOUNTINGS`."""
    position: float = 0.0
    """m: where a static run rests. Motions are about the centre."""
    role: str = "fit"

    def to_dict(self) -> dict[str, Any]:
        """Plain types, as in a plan's entry."""
        return asdict(self)


@dataclass(frozen=True)
class Plan:
    """A campaign: the runs in the order in which they are made."""

    name: str
    runs: tuple[PlanRun, ...]

    @property
    def duration(self) -> float:
        """Seconds of all runs, without the rests around them."""
        return sum(run.duration for run in self.runs)

    def to_dict(self) -> dict[str, Any]:
        """Plain types, as in a plan file."""
        return {"name": self.name, "runs": [run.to_dict() for run in self.runs]}


def shipped_plans() -> tuple[str, ...]:
    """Names of the plans that come with the package."""
    folder = resources.files(__package__) / "plans"
    return tuple(sorted(entry.name[: -len(".yaml")] for entry in folder.iterdir() if entry.name.endswith(".yaml")))


def load_plan(source: str) -> Plan:
    """A shipped plan by name, or a file; raises PlanError."""
    path = Path(source)
    if source in shipped_plans() and not path.is_file():
        text = (resources.files(__package__) / "plans" / f"{source}.yaml").read_text(encoding="utf-8")
        return parse_plan(text, source)
    if not path.is_file():
        raise PlanError(f"{source}: neither a file nor a shipped plan ({', '.join(shipped_plans())})")
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise PlanError(f"{source}: cannot be read: {error}") from error
    return parse_plan(text, path.stem, source)


def parse_plan(text: str, name: str, source: str | None = None) -> Plan:
    """Checks a plan's YAML; `source` is how messages call it."""
    source = source or name
    try:
        data = parse_yaml(text)
    except ValueError as error:
        raise PlanError(f"{source}: {error}") from error
    entries = data.get("runs") if isinstance(data, dict) else None
    if not isinstance(entries, list) or not entries:
        raise PlanError(f"{source}: has no list `runs:` with at least one run")
    return Plan(name, tuple(_parse_run(entry, f"{source}: run {i}") for i, entry in enumerate(entries)))


def _parse_run(entry: Any, where: str) -> PlanRun:
    known = [field.name for field in fields(PlanRun)]
    if not isinstance(entry, dict):
        raise PlanError(f"{where} is not a mapping of {', '.join(known)}")
    for key in entry:
        if key not in known:
            raise PlanError(f"{where}: {reprlib.repr(key)} is unknown; use {', '.join(known)}")
    run = PlanRun(
        shape=_choice(entry, "shape", SHAPES, where),
        duration=_number(entry, "duration", where),
        amplitude=_number(entry, "amplitude", where, 0.0),
        angular_frequency=_number(entry, "angular_frequency", where, 0.0),
        mounting=_choice(entry, "mounting", MOUNTINGS, where, "0"),
        position=_number(entry, "position", where, 0.0),
        role=_choice(entry, "role", ROLES, where, "fit"),
    )
    problem = _impossible(run)
    if problem:
        raise PlanError(f"{where}: {problem}")
    return run


def _choice(entry: dict[str, Any], key: str, choices: tuple[str, ...], where: str, default: str | None = None) -> str:
    value = entry.get(key, default)
    if value is None:
        raise PlanError(f"{where}: {key} is missing; use one of {', '.join(choices)}")
    if isinstance(value, bool) or str(value) not in choices:
        raise PlanError(f"{where}: {key} {reprlib.repr(value)} is unknown; use one of {', '.join(choices)}")
    return str(value)


def _number(entry: dict[str, Any], key: str, where: str, default: float | None = None) -> float:
    value = entry.get(key, default)
    if value is None:
        raise PlanError(f"{where}: {key} is missing")
    number = value if isinstance(value, (int, float)) and not isinstance(value, bool) else math.nan
    try:
        number = float(number)
    except OverflowError:  # an integer of 400 digits
        number = math.inf
    if not math.isfinite(number):
        raise PlanError(f"{where}: {key} {reprlib.repr(value)} is not a number")
    return number


def _impossible(run: PlanRun) -> str | None:
    """Why the rig cannot make this run; None where it can."""
    if not 0.0 < run.duration <= LONGEST:
        return f"duration {run.duration} s is not above 0 and at most {LONGEST:.0f} s"
    if abs(run.position) + run.amplitude > SOFT_LIMIT:
        return f"position {run.position} m with amplitude {run.amplitude} m leaves the soft limits of +-{SOFT_LIMIT} m"
    if run.shape == "static":
        return (
            "a static run has no amplitude and no angular_frequency" if run.amplitude or run.angular_frequency else None
        )
    return _impossible_motion(run)


def _impossible_motion(run: PlanRun) -> str | None:
    if run.amplitude <= 0.0 or run.angular_frequency <= 0.0:
        return f"a {run.shape} needs an amplitude and an angular_frequency above 0"
    if run.position:
        return "a motion is about the centre: leave position at 0"
    speed = run.amplitude * run.angular_frequency * (1.0 if run.shape == "sine" else 2.0 / math.pi)
    if speed > FASTEST:
        return f"needs {speed:.2f} m/s; the rig reaches {FASTEST} m/s"
    if run.shape == "sine" and run.amplitude * run.angular_frequency**2 > STRONGEST:
        return f"needs {run.amplitude * run.angular_frequency**2:.1f} m/s^2; the rig reaches {STRONGEST} m/s^2"
    if run.shape == "triangle" and not triangle_is_possible(run.amplitude, run.angular_frequency):
        return f"a triangle of {run.amplitude} m cannot turn round at {run.angular_frequency} rad/s"
    return None
