"""How a malformed input is answered, and what must hold of the answer.

A valid result (exit 0), or exit 2 with one line on stderr that begins with the command's name. Nothing half-written may
be left, and no case may take longer than `LONGEST` or more than `MEMORY`.
"""

from __future__ import annotations

import contextlib
import io
import json
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gsense_fusion import calibrate, close_loop, replay
from gsense_fusion.compensation import CompensationError, load_compensation
from gsense_rig import simulate
from gsense_rig.campaign.plan import PlanError, load_plan

LONGEST = 240
"""s: of a case on a loaded machine."""
LINE = 1500
"""Characters of an error line."""


@dataclass
class Verdict:
    """How a case was answered."""

    number: int
    what: str
    command: list[str]
    code: int | None = None
    line: str = ""
    faults: list[str] = field(default_factory=list)


def answer(verdict: Verdict, out: Path, call: Callable[[list[str], Path], int]) -> None:
    """Run the command and note what is wrong with its answer."""
    before = _listing(out)
    stdout, stderr = io.StringIO(), io.StringIO()
    try:
        with (
            contextlib.redirect_stdout(stdout),
            contextlib.redirect_stderr(stderr),
            warnings.catch_warnings(),
            _alarm(LONGEST),
        ):
            warnings.simplefilter("ignore")
            verdict.code = call(verdict.command, out)
    except TimeoutError:
        verdict.faults.append(f"took more than {LONGEST} s")
    except BaseException as error:  # whatever comes is the fault that is looked for
        if isinstance(error, KeyboardInterrupt):
            raise
        verdict.faults.append(f"raised {type(error).__name__}: {str(error)[:300]}")
    lines = stderr.getvalue().splitlines()
    verdict.line = lines[0] if lines else ""
    if not verdict.faults:
        _judge(verdict, lines, out, before)


def _judge(verdict: Verdict, lines: list[str], out: Path, before: set[str]) -> None:
    name = {"many": "close_loop"}.get(verdict.command[0], verdict.command[0])
    allowed = (0, 1, 2) if verdict.command[0] == "many" else (0, 2)
    if verdict.code not in allowed:
        verdict.faults.append(f"exit {verdict.code}")
    if verdict.code == 2:
        if len(lines) != 1 or not verdict.line.startswith(f"{name}: ") or len(verdict.line) > LINE:
            verdict.faults.append(f"not one line: {len(lines)} lines, {len(verdict.line)} characters")
        if "broke down" in verdict.line:
            verdict.faults.append("the analysis broke down")
        new = _listing(out) - before - {".lock"}
        if new and verdict.command[0] != "simulate":
            verdict.faults.append(f"left behind: {sorted(new)[:4]}")
    left = [p for p in _listing(out) if Path(p).name.startswith(".") and Path(p).name != ".lock"]
    if left:
        verdict.faults.append(f"temporary files: {left[:4]}")
    for document in ("report.json", "calibration.json", "accuracy.json", "summary.json", "compare.json"):
        if verdict.code in (0, 1) and (out / document).is_file():
            _strict_json(out / document, verdict)


def _strict_json(path: Path, verdict: Verdict) -> None:
    def refuse(name: str) -> Any:
        raise ValueError(name)

    try:
        json.loads(path.read_text(encoding="utf-8"), parse_constant=refuse)
    except ValueError as error:
        verdict.faults.append(f"{path.name} is not JSON: {error}")


def _listing(folder: Path) -> set[str]:
    return {str(p.relative_to(folder)) for p in folder.rglob("*")} if folder.is_dir() else set()


def in_its_own(command: list[str], out: Path) -> int:
    """The command as a user calls it."""
    name, *arguments = command
    if name == "load_compensation":
        return in_this_process(command, out)
    module = (
        "gsense_rig.simulate" if name == "simulate" else f"gsense_fusion.{'close_loop' if name == 'many' else name}"
    )
    options = ["--manifest", *arguments] if name == "many" else arguments
    done = subprocess.run(
        [sys.executable, "-m", module, *options, "--out", str(out)],
        capture_output=True,
        check=False,
        timeout=LONGEST,
        text=True,
        errors="replace",
    )
    sys.stderr.write(done.stderr)
    return done.returncode


def in_this_process(command: list[str], out: Path) -> int:
    name, *arguments = command
    if name == "load_compensation":  # what the nodes fusion and watch do before they start
        try:
            load_compensation(arguments[0])
        except CompensationError as error:
            sys.stderr.write(f"load_compensation: {error}\n")
            return 2
        return 0
    if name == "simulate" and not out.exists():
        with contextlib.suppress(PlanError):
            load_plan(arguments[0])
            return 0  # a plan that is sound is not worth its simulation
    if name == "many":
        return close_loop.main(["--manifest", arguments[0], "--out", str(out), "--jobs", "1"])
    mains = {"close_loop": close_loop, "calibrate": calibrate, "replay": replay, "simulate": simulate}
    return mains[name].main([*arguments, "--out", str(out)])


@contextlib.contextmanager
def _alarm(seconds: int) -> Iterator[None]:
    def ring(_number: int, _frame: object) -> None:
        raise TimeoutError

    before = signal.signal(signal.SIGALRM, ring)
    signal.alarm(seconds)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)
