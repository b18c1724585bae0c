"""Whether a command of the documents can work: its executable, options, topics and files exist.

Each check returns what is wrong, or an empty text. Who runs the executable is looked up by `run_by`.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import re
import shlex
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path

import yaml

from reference import graph, packages
from reference.commands import parser_of

ROOT = Path(__file__).resolve().parents[2]
EXECUTABLES = {f"{e.package} {e.name}": e for e in packages.executables()}
_FIRMWARE = {"gsense_firmware gsense_board", "gsense_firmware gsense_pic", "gsense_driver board"}
_RIG = {"demo", "test", "run", "exec", "shell", "build", "setup", "bench", "study", "-h"}
_PLACEHOLDER = re.compile(r"^(PKG|PACKAGE|COMMAND|EXE)$")

CANNOT_RUN = {
    "sudo": "changes the system; its files are checked to exist",
    "pip": "the apt way: needs a machine with an installed ROS; `./rig` has its own pins",
    "pip-audit": "asks a service of the package index",
    "source": "the apt way: needs an installed ROS",
    "colcon": "the apt way; tests/tools builds the same packages by colcon",
    "ls": "the machine's own devices",
    "python": "a file of the repository: it is checked to exist",
    "python3": "the same",
    "cmake": "tests/firmware/test_firmware.py configures and builds so",
    "ctest": "tests/firmware/test_firmware.py runs it",
    "ros2": "ROS's own command line is not among the wheels: names, types and fields are checked",
    "./rig bench": "minutes each, for an idle machine: name and options are checked",
    "./rig study": "hours; a quick part is in tests/fusion/identification",
    "./rig shell": "waits for a person",
    "firmware/pic/build": "tests/firmware/test_pic_build.py runs it, where the tool chain can be had",
}
"""Commands that no test types as they stand, and why; what can be known without is checked."""


@cache
def nodes() -> dict[str, graph.Notes]:
    return graph.nodes()


@cache
def parser(name: str) -> argparse.ArgumentParser | None:
    if name in nodes() and name != "gsense_rig record":
        return None
    return parser_of(EXECUTABLES[name])


def check(text: str) -> str:
    """What is wrong with a command; empty where nothing is known to be."""
    words = shlex.split(re.sub(r"[<>] ?\S+$", "", text.replace("...", " ")))
    if words[0] == "./rig":
        return _rig(words[1:])
    if words[0] == "ros2":
        return _ros2(words[1:])
    if words[0] in ("sudo", "python", "python3", "cmake") or words[0].startswith("firmware/"):
        return _files(words)
    return "" if words[0] in CANNOT_RUN else f"nothing is known of {words[0]}"


def _rig(words: list[str]) -> str:
    if not words or words[0] not in _RIG:
        return f"./rig has no command {words[:1]}"
    if words[0] == "run":
        return _run(words[1:])
    if words[0] == "demo":
        return _options("gsense_rig demo", words[1:])
    if words[0] == "bench":
        return _bench(words[1:])
    if words[0] in ("exec", "test"):
        needs_tools = words[0] == "exec" and "pytest" in words
        return "the tools of the tests are there after ./rig test alone" if needs_tools else _files(words[1:])
    return ""


def _ros2(words: list[str]) -> str:
    verbs: dict[str, Callable[[list[str]], str]] = {
        "run": _run, "launch": _launch, "service": _service, "action": _action, "topic": _topic, "param": _param,
    }  # fmt: skip
    if words[0] in verbs:
        return verbs[words[0]](words[1:])
    return "" if words[0] in ("bag", "lifecycle", "pkg") else f"ros2 has no {words[0]}"


def _run(words: list[str]) -> str:
    words = [word for word in words if not _PLACEHOLDER.match(word)]
    if not words:
        return ""
    name = " ".join(words[:2])
    if name in _FIRMWARE:
        return _firmware(words[2:])
    if name not in EXECUTABLES:
        return f"there is no {name}"
    arguments, ros = words[2:], []
    if "--ros-args" in arguments:
        at = arguments.index("--ros-args")
        arguments, ros = arguments[:at], arguments[at:]
    return _options(name, arguments) or _parameters(name, ros)


def _options(name: str, words: list[str]) -> str:
    found = parser(name)
    if not words:
        return ""
    if found is None:
        return f"{name} takes no arguments of its own"
    if any(re.search(r"[\[\]]|^[A-Z]+$", word) for word in words):  # a synopsis: its options alone
        known = {option for action in found._actions for option in action.option_strings}
        used = {word.strip("[]") for word in words if word.strip("[]").startswith("--")}
        return f"{name} has no {sorted(used - known)}" if used - known else ""
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            found.parse_args(words)
    except SystemExit as end:
        # which options belong together is said only where the rest is right
        incomplete = "required" in said.getvalue()
        return "" if end.code == 0 or incomplete else said.getvalue().strip().splitlines()[-1]
    return ""


def _parameters(name: str, ros: list[str]) -> str:
    given = [word.split(":=")[0].strip("[]\"'") for word in ros if ":=" in word and not word.startswith("__")]
    if not given:
        return ""
    if name not in nodes():
        return f"{name} is no node"
    known = {parameter.name for parameter in nodes()[name].parameters}
    return f"{name} has no parameter {sorted(set(given) - known)}" if set(given) - known else ""


def _firmware(words: list[str]) -> str:
    sources = "".join(file.read_text(encoding="utf-8") for file in (ROOT / "firmware").glob("*/**/*.c"))
    unknown = [word for word in words if word.startswith("--") and not re.search(rf'"(--)?{word[2:]}["= ]', sources)]
    return f"no option {unknown}" if unknown else ""


def _bench(words: list[str]) -> str:
    if not words:
        return ""
    files = [ROOT / "tests" / "bench" / folder / f"{words[0]}.py" for folder in ("", "slow")]
    found = [file for file in files if file.exists()]
    if not found:
        return f"there is no benchmark {words[0]}"
    source = found[0].read_text(encoding="utf-8")
    unknown = [word for word in words[1:] if word.startswith("--") and f'"{word}"' not in source]
    return f"{words[0]} has no {unknown}" if unknown else ""


def _files(words: list[str]) -> str:
    """Every file, folder, module or test of this repository that a command names exists."""
    for word in words:
        place = word.split("::")[0].rstrip("*")
        if re.match(r"(tests|docs|src|tools|firmware)/[\w./-]+", place) and "build/" not in place:
            if not (ROOT / place).exists() and place != "firmware/build":
                return f"there is no {place}"
        elif re.fullmatch(r"tests(\.\w+)+", place) and not (ROOT / f"{place.replace('.', '/')}.py").exists():
            return f"there is no module {place}"
    return ""


def _launch(words: list[str]) -> str:
    name = " ".join(words[:2])
    files = packages.launch_files()
    if name not in files:
        return f"there is no launch file {name}"
    given = {word.split(":=")[0] for word in words[2:] if ":=" in word}
    unknown = given - {argument.name for argument in files[name]}
    return f"{name} has no argument {sorted(unknown)}" if unknown else ""


def _service(words: list[str]) -> str:
    known = {f"/{name}" for notes in nodes().values() for name, _ in notes.services}
    if words[0] != "call" or words[1] not in known:
        return f"no service {words[1:2]}"
    return _fields(words[2], "Request", words[3:])


def _action(words: list[str]) -> str:
    known = {f"/{name}" for notes in nodes().values() for name, _ in notes.actions}
    if words[0] != "send_goal" or words[1] not in known:
        return f"no action {words[1:2]}"
    return _fields(words[2], "Goal", words[3:])


def _fields(type_: str, part: str, rest: list[str]) -> str:
    package, kind, name = type_.split("/")
    message = getattr(getattr(import_module(f"{package}.{kind}"), name), part)()
    try:
        for field, value in (yaml.safe_load(rest[0]) if rest else {}).items():
            setattr(message, field, value)  # messages refuse unknown names and wrong types
    except (AttributeError, AssertionError) as error:
        return f"{type_}: {error}"
    return ""


def _topic(words: list[str]) -> str:
    known = {f"/{e.name.lstrip('/')}" for notes in nodes().values() for e in (*notes.publishes, *notes.subscribes)}
    named = [word for word in words[1:] if word.startswith("/")]
    unknown = [word for word in named if word not in known]
    return f"no topic {unknown}" if unknown else ""


def _param(words: list[str]) -> str:
    found = [notes for name, notes in nodes().items() if f"/{name.split()[1]}" == words[1]]
    if not found:
        return f"no node {words[1]}"
    if len(words) > 2 and words[2] not in {parameter.name for parameter in found[0].parameters} | {"NAME"}:
        return f"{words[1]} has no parameter {words[2]}"
    return ""


def run_by(name: str) -> list[Path]:
    """The tests that run an executable: by its module, or by its name beside its package."""
    executable = EXECUTABLES[name]
    alone = executable.module.rsplit(".", 1)[-1]
    patterns = (rf"{executable.module}\b", rf'"{executable.package}", "{executable.name}"', rf"import .*\b{alone}\b")
    tests = [file for file in (ROOT / "tests").rglob("*.py") if "bench" not in file.parts and "docs" not in file.parts]
    return [file for file in tests if re.search("|".join(patterns), file.read_text(encoding="utf-8"))]
