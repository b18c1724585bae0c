"""Makes runtime.txt, jazzy.txt and dev.txt (each package, transitive ones too, at one version) from the .in files.

Usage: python3 lock.py PYTHON [PYTHON ...]     one interpreter of each supported version, 3.10 to 3.13
       python3 lock.py --hashes                only the hashes of the pins that are there

Each interpreter's own pip resolves the .in files; where the answers differ the line carries a marker. uv adds the
SHA-256 of every file that the index has of a version, so that the set-up takes the same bytes on any machine.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
HEADER = "# Made by lock.py from {source}; installed with --no-deps --require-hashes.\n"
JAZZY_PYTHON = "3.12"  # Ubuntu 24.04's
OLDEST_PYTHON = "3.10"
Pins = dict[str, str]  # normalised name -> exact version


def resolve(python: str, *sources: str) -> Pins:
    """Ask the pip of a fresh environment of `python` what it would install."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, "-m", "venv", folder], check=True)
        report = Path(folder) / "report.json"
        files = [part for source in sources for part in ("-r", str(HERE / source))]
        pip = [f"{folder}/bin/python", "-m", "pip", "install", "--quiet", "--dry-run", "--ignore-installed"]
        installs = []
        for asked in (files, ["--no-deps", "-r", str(HERE / "alone.in")]):
            subprocess.run([*pip, "--report", str(report), *asked], check=True)
            installs += json.loads(report.read_text(encoding="utf-8"))["install"]
    return {item["metadata"]["name"].lower().replace("_", "-"): item["metadata"]["version"] for item in installs}


def version_of(python: str) -> str:
    """Version of an interpreter as MAJOR.MINOR."""
    code = "import sys; print('%d.%d' % sys.version_info[:2])"
    return subprocess.run([python, "-c", code], check=True, capture_output=True, text=True).stdout.strip()


def lines(answers: dict[str, Pins]) -> list[str]:
    """Merge the answers (Python version -> pins) into requirement lines."""
    merged = []
    for name in sorted({name for pins in answers.values() for name in pins}):
        by_version: dict[str, list[str]] = {}
        for python, pins in answers.items():
            if name in pins:
                by_version.setdefault(pins[name], []).append(python)
        for version, pythons in by_version.items():
            everywhere = len(pythons) == len(answers)
            marker = "" if everywhere else " ; " + " or ".join(f'python_version == "{python}"' for python in pythons)
            merged.append(f"{name}=={version}{marker}\n")
    return merged


def hashed(pins: list[str], uv: str, *options: str) -> list[str]:
    """The same requirement lines, each with the hashes of all files of its version."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "pins.in", Path(folder) / "hashed.txt"
        source.write_text("".join(pins), encoding="utf-8")
        command = [uv, "pip", "compile", "--quiet", "--no-deps", "--generate-hashes", "--no-header", "--no-annotate"]
        subprocess.run([*command, *options, str(source), "-o", str(target)], check=True)
        joined = target.read_text(encoding="utf-8").replace("\\\n", " ").splitlines()
    found = {_normal(line): re.findall(r"--hash=sha256:[0-9a-f]{64}", line) for line in joined}
    lines = []
    for pin in pins:
        hashes = found[_normal(pin)]
        if not hashes:
            sys.exit(f"the index has no hash of {pin.strip()}")
        lines.append(f"{pin.strip()} {' '.join(hashes)}\n")
    return lines


def _normal(line: str) -> str:
    """NAME==VERSION of a requirement line, the name as indexes spell it."""
    name, version = line.split(maxsplit=1)[0].split("==")
    return f"{re.sub(r'[-_.]+', '-', name).lower()}=={version}"


def write(name: str, pins: list[str], uv: str) -> None:
    """Write NAME.txt with the pins and their hashes."""
    of_one = ("--python-version", JAZZY_PYTHON)
    options = of_one if name == "jazzy" else ("--universal", "--python-version", OLDEST_PYTHON)
    text = HEADER.format(source=f"{name}.in") + "".join(hashed(pins, uv, *options))
    (HERE / f"{name}.txt").write_text(text, encoding="utf-8")


def pins_of(name: str) -> list[str]:
    """The requirement lines of NAME.txt without their hashes."""
    text = (HERE / f"{name}.txt").read_text(encoding="utf-8")
    return [f"{line.split(' --hash', 1)[0]}\n" for line in text.splitlines() if not line.startswith("#")]


def main() -> None:
    """Resolve for every interpreter named on the command line and write the files."""
    uv = shutil.which("uv")
    if uv is None:
        sys.exit("no uv on the PATH: pip install uv")
    if sys.argv[1:] == ["--hashes"]:
        for name in ("runtime", "jazzy", "dev"):
            write(name, pins_of(name), uv)
        return
    runtime: dict[str, Pins] = {}
    both: dict[str, Pins] = {}
    jazzy: dict[str, Pins] = {}
    for python in sys.argv[1:]:
        version = version_of(python)
        print(f"resolving for Python {version}", file=sys.stderr)
        runtime[version] = resolve(python, "runtime.in")
        both[version] = resolve(python, "runtime.in", "dev.in")
        if version == JAZZY_PYTHON:
            jazzy[version] = resolve(python, "jazzy.in")
        moved = {name for name, pin in runtime[version].items() if both[version][name] != pin}
        if moved:
            sys.exit(f"dev.in moves runtime pins: {', '.join(sorted(moved))}: limit them in runtime.in")
    dev = {
        python: {name: pin for name, pin in pins.items() if name not in runtime[python]}
        for python, pins in both.items()
    }
    for name, answers in (("runtime", runtime), ("jazzy", jazzy), ("dev", dev)):
        write(name, lines(answers), uv)


if __name__ == "__main__":
    main()
