"""The colcon workspace: which packages changed since they were built, and building those."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import dataclass
from pathlib import Path

from preparation import stamps
from preparation.checkout import Checkout
from preparation.errors import SetupError
from preparation.progress import step

_IGNORED = {"__pycache__", "build", ".pytest_cache", ".mypy_cache", ".ruff_cache"}


@dataclass(frozen=True)
class Package:
    """A package of the workspace."""

    name: str
    folder: Path
    fingerprint: str  # of its sources
    build_type: str  # ament_python, ament_cmake, cmake

    @property
    def stamp(self) -> str:
        """Name of its stamp."""
        return f"package-{self.name}"


def packages(checkout: Checkout) -> list[Package]:
    """All packages under src/ and firmware/, by name.

    Raises:
        SetupError: a package.xml cannot be read.
    """
    found = []
    for manifest in sorted([*checkout.root.glob("src/*/package.xml"), *checkout.root.glob("firmware/package.xml")]):
        try:
            tree = ET.parse(manifest)  # noqa: S314 (our own file)
        except ET.ParseError as error:
            raise SetupError(f"{manifest}: {error}") from error
        name = tree.findtext("name", default=manifest.parent.name)
        build_type = tree.findtext("export/build_type", default="ament_cmake")
        found.append(Package(name, manifest.parent, fingerprint(manifest.parent), build_type))
    return found


def fingerprint(folder: Path) -> str:
    """Hash of all source files' names and contents."""
    files = []
    for place, folders, names in os.walk(folder):
        folders[:] = sorted(name for name in folders if name not in _IGNORED and not name.startswith("build"))
        files += [Path(place) / name for name in sorted(names) if not name.endswith((".pyc", ".swp", "~"))]
    return stamps.digest_files(files, *(str(file.relative_to(folder)) for file in files))


def to_build(checkout: Checkout, build: str) -> list[Package]:
    """The packages that a build has to touch: `stale`, all that changed; `missing`, those never built."""
    chosen = []
    for package in packages(checkout):
        former = stamps.read(checkout.stamps, package.stamp)
        if build == "missing":
            # A `colcon build` by hand counts too: it leaves no stamp, but a finished build.
            if not former and not _succeeded(checkout, package):
                chosen.append(package)
        elif former != package.fingerprint or not _installed(checkout, package).exists():
            chosen.append(package)
    return chosen


def _installed(checkout: Checkout, package: Package) -> Path:
    return checkout.root / "install" / package.name / "share" / package.name / "package.xml"


def build(checkout: Checkout, chosen: list[Package]) -> None:
    """Build packages with colcon; stamp those that succeeded.

    Raises:
        SetupError: a package failed; its compiler's output has been shown.
    """
    for package in chosen:
        _clear(checkout, package)
    for gone in _gone(checkout):
        shutil.rmtree(checkout.root / "install" / gone, ignore_errors=True)
        shutil.rmtree(checkout.root / "build" / gone, ignore_errors=True)
        stamps.remove(checkout.stamps, f"package-{gone}")
    names = [package.name for package in chosen]
    script = '. "$ROOT/tools/activate.sh"; exec python -c "from colcon_core.command import main; main()" "$@"'
    options = ["--log-base", "log", "build", "--continue-on-error", "--packages-select", *names]
    environment = os.environ | {
        "ROOT": str(checkout.root),
        "GSENSE_UNDERLAY_ONLY": "1",
        "PYTHONWARNINGS": "ignore",
    }
    with step(f"build of {', '.join(names)}"):
        code = subprocess.run(
            ["bash", "-c", script, "colcon", *options], cwd=checkout.root, env=environment, stdout=2, check=False
        ).returncode
    failed = []
    for package in chosen:
        if _succeeded(checkout, package):
            stamps.write(checkout.stamps, package.stamp, package.fingerprint)
        else:
            failed.append(package.name)
    if failed or code != 0:
        _show_errors(checkout, failed)
        raise SetupError(f"build of {', '.join(failed) or 'the workspace'} failed; its output is in log/latest_build")


def _clear(checkout: Checkout, package: Package) -> None:
    """Remove what a new build would not replace: a Python package's removed modules, an interrupted first build."""
    former = stamps.read(checkout.stamps, package.stamp)
    stamps.remove(checkout.stamps, package.stamp)
    if package.build_type == "ament_python" or not former:
        shutil.rmtree(checkout.root / "install" / package.name, ignore_errors=True)
        shutil.rmtree(checkout.root / "build" / package.name, ignore_errors=True)
    else:
        (checkout.root / "build" / package.name / "colcon_build.rc").unlink(missing_ok=True)


def _gone(checkout: Checkout) -> list[str]:
    """Packages that were built here once and are no longer in the sources."""
    known = {package.stamp for package in packages(checkout)}
    built = sorted(file.name for file in checkout.stamps.glob("package-*") if file.name not in known)
    return [name.removeprefix("package-") for name in built]


def _succeeded(checkout: Checkout, package: Package) -> bool:
    code = checkout.root / "build" / package.name / "colcon_build.rc"
    return code.exists() and code.read_text().strip() == "0" and _installed(checkout, package).exists()


def _show_errors(checkout: Checkout, failed: list[str]) -> None:
    """Copy what the failed packages' builds wrote to stderr."""
    for name in failed:
        log = checkout.root / "log" / "latest_build" / name / "stdout_stderr.log"
        if log.exists():
            print(log.read_text(encoding="utf-8", errors="replace")[-4000:], file=sys.stderr)
