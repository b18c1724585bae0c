"""A workspace that was built and sourced as everybody does it finds each of its packages."""

from __future__ import annotations

import os
import subprocess
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SETUP = ROOT / "install" / "setup.bash"
NAMES = sorted(
    str(ET.parse(p).findtext("name")) for p in (*ROOT.glob("src/*/package.xml"), ROOT / "firmware/package.xml")
)


@pytest.mark.skipif(not SETUP.is_file(), reason="not built: ./rig build")
def test_setup_bash_names_every_package() -> None:
    """`ros2 run` and the board's start look in AMENT_PREFIX_PATH, which colcon writes for ament packages only."""
    clean = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    said = subprocess.run(
        ["bash", "-c", f'. "{SETUP}" 2>/dev/null; printf %s "$AMENT_PREFIX_PATH"'],
        env=clean, check=True, capture_output=True, text=True,
    )  # fmt: skip
    prefixes = [Path(p) for p in said.stdout.split(":") if p]
    found = {
        name for name in NAMES for p in prefixes if (p / "share/ament_index/resource_index/packages" / name).exists()
    }
    assert found == set(NAMES)
