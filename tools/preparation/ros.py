"""Which ROS 2 Jazzy is used: the one that is sourced, the one that is installed, or the wheels of PyPI."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

from preparation.errors import SetupError

_DEFAULT_PREFIX = "/opt/ros/jazzy"
_CAPTURED = ("PATH", "LD_LIBRARY_PATH", "PYTHONPATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "PKG_CONFIG_PATH")
_PLAIN = ("ROS_DISTRO", "ROS_VERSION", "ROS_PYTHON_VERSION")


@dataclass(frozen=True)
class Ros:
    """An apt (or source) Jazzy at `prefix`; None: the wheels."""

    prefix: Path | None

    @property
    def name(self) -> str:
        """How stamps and messages call it."""
        return str(self.prefix) if self.prefix else "wheels"


def find() -> Ros:
    """Find Jazzy. GSENSE_ROS_PREFIX names another prefix than /opt/ros/jazzy; empty, it asks for the wheels."""
    prefix = os.environ.get("GSENSE_ROS_PREFIX")
    if prefix is None and os.environ.get("ROS_DISTRO") == "jazzy":
        # The sourced underlay is the last entry that has a setup.bash.
        entries = [Path(entry) for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(":") if entry]
        underlays = [entry for entry in entries if (entry / "share" / "rclpy").is_dir() and _setup(entry).is_file()]
        if underlays:
            return Ros(underlays[-1])
    chosen = Path(_DEFAULT_PREFIX if prefix is None else prefix)
    if prefix and not _setup(chosen).is_file():
        raise SetupError(f"GSENSE_ROS_PREFIX={prefix} has no setup.bash: name a Jazzy prefix, or leave it empty")
    return Ros(chosen) if prefix != "" and _setup(chosen).is_file() else Ros(None)


def _setup(prefix: Path) -> Path:
    return prefix / "setup.bash"


def sourced(prefix: Path) -> dict[str, str]:
    """What sourcing `prefix`/setup.bash in a clean shell adds: path variables without their former value."""
    clean = {"PATH": "/usr/local/bin:/usr/bin:/bin", "HOME": os.environ.get("HOME", "/"), "LANG": "C.UTF-8"}
    script = f'. "{_setup(prefix)}" >/dev/null && env -0'
    result = subprocess.run(["bash", "-c", script], env=clean, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise SetupError(f"sourcing {_setup(prefix)} failed: {result.stderr.strip().splitlines()[-1:]}")
    after = dict(item.split("=", 1) for item in result.stdout.split("\0") if "=" in item)
    added = {}
    for name in _CAPTURED:
        former = clean.get(name, "").split(":")
        entries = [entry for entry in after.get(name, "").split(":") if entry and entry not in former]
        if entries:
            added[name] = ":".join(entries)
    added.update({name: after[name] for name in _PLAIN if name in after})
    return added
