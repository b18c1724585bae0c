"""Sets the project's version everywhere: `python3 tools/version.py 0.4.0`; tests/tools/test_house.py checks."""

from __future__ import annotations

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def places() -> list[tuple[Path, str]]:
    """Files with a version of their own, and the pattern whose only group it is."""
    manifests = [*ROOT.glob("src/*/package.xml"), ROOT / "firmware" / "package.xml"]
    config = ROOT / "firmware" / "core" / "config.h"
    return [
        (ROOT / "VERSION", r"^(\S+)\n"),
        (ROOT / "CITATION.cff", r"(?m)^version: (\S+)$"),
        *((file, r"<version>(.*)</version>") for file in manifests),
        (config, r"#define FIRMWARE_MAJOR (\d+)u"),
        (config, r"#define FIRMWARE_MINOR (\d+)u"),
    ]


def wanted(pattern: str, version: str) -> str:
    """The part of the version that a place has."""
    major, minor, _ = version.split(".")
    return major if "MAJOR" in pattern else minor if "MINOR" in pattern else version


def main() -> None:
    """Write the version given."""
    if len(sys.argv) != 2 or not re.fullmatch(r"\d+\.\d+\.\d+", sys.argv[1]):
        sys.exit("usage: python3 tools/version.py MAJOR.MINOR.PATCH")
    for file, pattern in places():
        text = file.read_text(encoding="utf-8")
        found = re.search(pattern, text)
        if found is None:
            sys.exit(f"{file}: no version found")
        new = text[: found.start(1)] + wanted(pattern, sys.argv[1]) + text[found.end(1) :]
        file.write_text(new, encoding="utf-8")
    print(f"{sys.argv[1]}: now write its entry in CHANGELOG.md")


if __name__ == "__main__":
    main()
