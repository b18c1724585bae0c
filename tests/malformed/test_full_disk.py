"""A full disk: one line, exit 2, and nothing half-written; on a real file system that is too small."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from tests.malformed.cases import Material

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def material(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Material.make(tmp_path_factory.mktemp("material")).folder


@pytest.mark.parametrize(
    ("what", "kilobytes", "left"),
    [("close_loop", 40, set()), ("many", 900, None), ("simulate", 120, None), ("replay", 60, set())],
)
def test_one_line_and_nothing_half_written(
    tmp_path: Path, material: Path, what: str, kilobytes: int, left: set[str] | None
) -> None:
    small = tmp_path / "small"
    small.mkdir()
    namespace = ["unshare", "--map-root-user", "--mount", "sh", "-c"]
    mount = f"mount -t tmpfs -o size={kilobytes}k none {small}"
    if subprocess.run([*namespace, mount], check=False, capture_output=True).returncode:
        pytest.skip("this machine allows no mount in a namespace of one's own (unshare --map-root-user --mount)")
    command = f"{mount} && exec {sys.executable} -m tests.malformed.full_disk {what} {small} {material}"
    done = subprocess.run([*namespace, command], check=False, capture_output=True, text=True, cwd=ROOT, timeout=200)
    lines = done.stderr.splitlines()
    assert done.returncode == 2, done.stderr
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith(f"{what}: ")
    assert "No space left on device" in lines[0]
    found = set(eval(done.stdout.splitlines()[-1].removeprefix("left: ")))
    assert not [name for name in found if ".unfinished" in name or name.endswith(".tmp")]
    if left is not None:
        assert found == left
