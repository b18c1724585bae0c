"""Writes docs/interfaces.md from the code: `./rig exec python tools/interfaces.py`."""

from __future__ import annotations

import sys

from reference.packages import PACKAGES, ROOT

# the sources, not the copy that was last installed
sys.path[:0] = [str(ROOT / "src" / package) for package in PACKAGES]
from reference.page import page  # noqa: E402

PAGE = ROOT / "docs" / "interfaces.md"


def main() -> None:
    """Write the page, under another name first."""
    new = PAGE.with_suffix(".new")
    new.write_text(page(), encoding="utf-8")
    new.replace(PAGE)
    print(PAGE.relative_to(ROOT))


if __name__ == "__main__":
    main()
