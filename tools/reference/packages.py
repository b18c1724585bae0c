"""What the workspace declares without being run: executables, messages, launch arguments, schemas."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET  # our own files

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("gsense_driver", "gsense_rig", "gsense_fusion")


@dataclass(frozen=True)
class Executable:
    """What `ros2 run` starts."""

    package: str
    name: str
    module: str
    function: str


@dataclass(frozen=True)
class LaunchArgument:
    """One argument of a launch file."""

    name: str
    default: str
    text: str


def executables() -> Iterator[Executable]:
    """The console scripts of every package's setup.py."""
    for package in PACKAGES:
        tree = ast.parse((ROOT / "src" / package / "setup.py").read_text(encoding="utf-8"))
        texts = [
            node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)
        ]
        for text in texts:
            found = re.fullmatch(r"(\w+) = ([\w.]+):(\w+)", text)
            if found:
                yield Executable(package, *found.groups())


def launch_files() -> dict[str, list[LaunchArgument]]:
    """Arguments by `PACKAGE FILE`."""
    files = {}
    for file in sorted(ROOT.glob("src/*/launch/*.launch.xml")):
        arguments = ET.parse(file).getroot().findall("arg")  # noqa: S314
        files[f"{file.parts[-3]} {file.name}"] = [
            LaunchArgument(a.attrib["name"], a.get("default", ""), a.get("description", "")) for a in arguments
        ]
    return files


def messages() -> dict[str, str]:
    """Definitions by `msg/Name`, as they stand in gsense_msgs."""
    folder = ROOT / "src" / "gsense_msgs"
    files = [*sorted(folder.glob("msg/*.msg")), *sorted(folder.glob("action/*.action"))]
    return {f"{file.parent.name}/{file.stem}": file.read_text(encoding="utf-8") for file in files}


def schemas() -> list[str]:
    """Names of the files' schemas that the packages' sources mention."""
    sources = [*ROOT.glob("src/*/gsense_*/**/*.py")]
    text = "".join(file.read_text(encoding="utf-8") for file in sources)
    return sorted(set(re.findall(r'"(gsense-[a-z-]+/\d+)"', text)))


def environment_variables() -> list[str]:
    """Names of the variables that sources and scripts look at."""
    sources = [*ROOT.glob("src/*/gsense_*/**/*.py"), *ROOT.glob("tools/preparation/*.py"), *ROOT.glob("tools/*.sh")]
    sources += [*ROOT.glob("firmware/pic/*.py"), ROOT / "rig", *ROOT.glob("tests/*/*.py")]
    lines = [line for file in sources for line in file.read_text(encoding="utf-8").splitlines()]
    named = [line for line in lines if "GSENSE_" in line and re.search(r"env|\$", line) and "{GSENSE_V" not in line]
    return sorted(set(re.findall(r"\bGSENSE_[A-Z_]*[A-Z]\b", "\n".join(named))))
