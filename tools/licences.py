"""Writes docs/licences.md, the licence of every pin by its own metadata: `./rig exec python tools/licences.py`.

Run it in the environment with the test tools (`./rig setup`); what only other Python versions need keeps its line.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from email.message import Message
from importlib import metadata
from pathlib import Path
from typing import cast

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "licences.md"
HEAD = """# Licences

gsense itself: Apache-2.0, see [LICENSE](../LICENSE). What `./rig` installs, as each package's own metadata says; made
by `./rig exec python tools/licences.py` from the pins in `tools/requirements`, checked by `tests/tools/test_house.py`.
`allantools` (LGPL) is imported as it is installed, none of it is copied.

| package | licence | needed for |
|---|---|---|
"""
TAIL = """
## In the repository

| what | from | licence |
|---|---|---|
| `tests/bags/rail_7.mcap` | simulated by `gsense_rig simulate` | Apache-2.0 |
| `src/gsense_rig/gsense_rig/dashboard/static/uPlot*` | uPlot 1.6.32, npm `uplot` | MIT, its text beside it |

The PIC's tool chain (SDCC, gputils, gpsim: GPL) is fetched and built outside of the repository, only by
`firmware/pic/build` and its tests.

## Known vulnerabilities

```
pip-audit --requirement tools/requirements/runtime.txt --disable-pip --require-hashes
```

`tests/tools/test_audit.py` runs it over all pins where `pip-audit` is installed and its service answers; elsewhere it
skips and says why. Where this was written, the registry serves packages alone: **no audit has been made yet**.
"""
TOOLS_UNDER_GPL = {"docutils"}
"""Of its parts a few are under the GPL; it is a tool of the build and not imported by gsense."""
# Where the metadata is silent or unclear, as the project's own page says.
_KNOWN = {
    "apsw": "any OSI-approved",
    "ros-fastcdr": "Apache-2.0",
    "ros-fastrtps": "Apache-2.0",
    "exceptiongroup": "MIT AND PSF-2.0",
    "matplotlib": "PSF-based",
    "setuptools": "MIT",
    "six": "MIT",
    "tomli": "MIT",
    "allantools": "LGPL-3.0-or-later",
    "pytest-timeout": "MIT",
    "docutils": "public domain, BSD-2-Clause; a few files GPL-3.0",
    "python-dateutil": "Apache-2.0 AND BSD-3-Clause",
    "tzdata": "Apache-2.0",
}


def pinned() -> dict[str, str]:
    """Normalised names of all pins, and what they are needed for."""
    found: dict[str, str] = {}
    for name, purpose in (("runtime", "run"), ("dev", "test")):
        for line in (ROOT / "tools" / "requirements" / f"{name}.txt").read_text(encoding="utf-8").splitlines():
            if not line.startswith("#"):
                found.setdefault(_normal(line.split("==")[0]), purpose)
    return found


def told() -> dict[str, str]:
    """Licences by package, from the page."""
    rows = re.findall(r"^\| `(\S+)` \| (.*?) \| (?:run|test) \|$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)
    return dict(rows)


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _of(name: str, former: dict[str, str]) -> str:
    if name in _KNOWN:
        return _KNOWN[name]
    try:
        found = metadata.metadata(name)
    except metadata.PackageNotFoundError:
        return former.get(name, "")
    return _of_manifest(name) if name.startswith("ros-") else _of_metadata(found)


def _of_metadata(metadata_of: metadata.PackageMetadata) -> str:
    found = cast(Message, metadata_of)  # what importlib returns; its protocol lacks get() in Python 3.10
    if found.get("License-Expression"):
        return found["License-Expression"]
    classes = [text.split(" :: ")[-1] for text in found.get_all("Classifier") or [] if text.startswith("License ::")]
    text = next(iter((found.get("License") or "").strip().splitlines()), "")
    return ", ".join(classes) or (text if re.match(r"[A-Z]", text) else "")


def _of_manifest(name: str) -> str:
    """A ROS package's, from its package.xml."""
    short = re.sub(r"^ros-(jazzy-)?", "", name)
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        for manifest in _manifests(Path(prefix), short):
            return ", ".join(
                sorted(set(re.findall(r"<license[^>]*>\s*(.*?)\s*<", manifest.read_text(encoding="utf-8"))))
            )
    return _of_metadata(metadata.metadata(name))


def _manifests(prefix: Path, short: str) -> Iterator[Path]:
    for folder in (short.replace("-", "_"), short):
        manifest = prefix / "share" / folder / "package.xml"
        if manifest.exists():
            yield manifest


def main() -> None:
    """Write the page."""
    former = told() if PAGE.exists() else {}
    rows = [(name, _of(name, former), purpose) for name, purpose in sorted(pinned().items())]
    silent = [name for name, licence, _ in rows if not licence]
    if silent:
        raise SystemExit(f"no licence known of {', '.join(silent)}: look it up and add it to _KNOWN")
    text = HEAD + "".join(f"| `{name}` | {licence} | {purpose} |\n" for name, licence, purpose in rows) + TAIL
    new = PAGE.with_suffix(".new")
    new.write_text(text, encoding="utf-8")
    new.replace(PAGE)
    print(PAGE.relative_to(ROOT))


if __name__ == "__main__":
    main()
