"""Known vulnerabilities of what is pinned, where the service can be asked."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

REQUIREMENTS = Path(__file__).resolve().parents[2] / "tools" / "requirements"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["runtime", "dev"])
def test_nothing_pinned_is_known_to_be_vulnerable(name: str) -> None:
    audit = shutil.which("pip-audit")
    if audit is None:
        pytest.skip("no pip-audit on the PATH: pip install pip-audit")
    command = [audit, "--requirement", str(REQUIREMENTS / f"{name}.txt"), "--disable-pip", "--require-hashes"]
    command += ["--format", "json", "--progress-spinner", "off"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    if not done.stdout.strip():
        pytest.skip(f"pip-audit's service does not answer: {done.stderr.strip().splitlines()[-1][:200]}")
    told = json.loads(done.stdout)["dependencies"]
    if all("skip_reason" in package for package in told):
        pytest.skip(f"pip-audit's service knows none of the packages: {told[0]['skip_reason']}")
    assert {package["name"]: package["vulns"] for package in told if package.get("vulns")} == {}
