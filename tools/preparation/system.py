"""What has to come from the system's package manager: installed where we may, named in one line where not."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sysconfig
from pathlib import Path

from preparation.checkout import Checkout
from preparation.errors import SetupError
from preparation.progress import say, step


def missing_for_build() -> list[str]:
    """Debian packages that the environment and the build need and that are not there."""
    packages = []
    if not all(importlib.util.find_spec(name) for name in ("venv", "ensurepip")):
        packages.append("python3-venv")
    if not (Path(sysconfig.get_paths()["include"]) / "Python.h").exists():
        packages.append("python3-dev")
    if not shutil.which("gcc") or not has_header("stdio.h"):
        packages += ["gcc", "libc6-dev"]
    if not shutil.which("g++"):
        packages.append("g++")
    return packages


def missing_for_tests() -> list[str]:
    """Debian packages that the firmware's tests need and that are not there."""
    packages = []
    if not has_header("cmocka.h"):
        packages.append("libcmocka-dev")
    if not shutil.which("cppcheck"):
        packages.append("cppcheck")
    if not shutil.which("gpsim"):  # the emulated chip's core is held against it
        packages.append("gpsim")
    return packages


def has_header(name: str) -> bool:
    """Whether the C compiler finds a system header."""
    if any((Path(folder) / name).exists() for folder in ("/usr/include", "/usr/local/include")):
        return True
    if not shutil.which("gcc"):
        return False
    probe = subprocess.run(["gcc", "-E", "-include", name, "-x", "c", "/dev/null"], capture_output=True, check=False)
    return probe.returncode == 0


def require(checkout: Checkout) -> None:
    """Install what the build lacks.

    Raises:
        SetupError: it cannot be installed from here; the text is the command that does it.
    """
    packages = missing_for_build()
    if packages and not (install(checkout, packages) and not missing_for_build()):
        raise SetupError(f"gsense needs {', '.join(packages)}: sudo apt install {' '.join(packages)}")


def offer_for_tests(checkout: Checkout) -> None:
    """Install what the firmware's tests lack, or say which tests will not run."""
    packages = missing_for_tests()
    if packages and not install(checkout, packages):
        names = " ".join(packages)
        say(f"{names} not installed, so the firmware tests that need them are skipped: sudo apt install {names}")


def install(checkout: Checkout, packages: list[str]) -> bool:
    """Install Debian packages. False where that is not possible (not root, no apt, no network)."""
    if os.geteuid() != 0 or not shutil.which("apt-get"):
        return False
    checkout.logs.mkdir(parents=True, exist_ok=True)
    command = ["apt-get", "install", "--yes", "--no-install-recommends", *packages]
    environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
    with step(f"apt-get install {' '.join(packages)}"), (checkout.logs / "apt.log").open("w") as log:
        for attempt in (command, ["apt-get", "update"], command):
            done = subprocess.run(attempt, stdout=log, stderr=log, env=environment, check=False).returncode == 0
            if done and attempt is command:
                return True
    return False
