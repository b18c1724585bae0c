"""The set-up takes the bytes that were locked: every pin has its hashes, every pip install asks for them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
REQUIREMENTS = ROOT / "tools" / "requirements"
PIN = re.compile(r"[A-Za-z0-9._-]+==\S+( ; python_version == .*?)?( --hash=sha256:[0-9a-f]{64})+")


@pytest.mark.parametrize("name", ["runtime", "jazzy", "dev"])
def test_every_pin_has_its_hashes(name: str) -> None:
    lines = (REQUIREMENTS / f"{name}.txt").read_text(encoding="utf-8").splitlines()
    pins = [line for line in lines if not line.startswith("#")]
    assert pins
    assert [line for line in pins if not PIN.fullmatch(line)] == []


def test_every_install_asks_for_the_hashes() -> None:
    asked = 0
    for file in [*ROOT.glob("tools/preparation/*.py"), *ROOT.glob("firmware/**/*.py")]:
        for install in re.findall(r'"pip", "install".*', file.read_text(encoding="utf-8")):
            assert "--require-hashes" in install, file
            asked += 1
    assert asked >= 2
