"""Set-up, live graph, recording, analysis and page on a machine without any network but the loopback."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

from .processes import executable
from .without_network import command, why_not

pytestmark = [pytest.mark.graph, pytest.mark.usefixtures("domain"), pytest.mark.timeout(600)]
ROOT = Path(__file__).resolve().parents[2]
PLAN = "runs:\n  - {shape: static, duration: 2, role: fit}\n"
SCRIPT = """
set -e
if python -c "import socket; socket.create_connection(('192.0.2.1', 80), 2)" 2>/dev/null; then exit 3; fi
./rig exec true
"$1" plan.yaml --yes --out out
"$2" out/run_00 --sensor mpu6050 --filters madgwick --no-bag --out replayed
"$3" --ros-args -p port:=0 >page.txt &
trap "kill $!" EXIT
until [ -s page.txt ]; do sleep 0.2; done
python -c "
import urllib.request, pathlib
address = pathlib.Path('page.txt').read_text().split()[1].partition('#')[0]
assert b'<html' in urllib.request.urlopen(address, timeout=60).read()"
"""


def test_everything_works_without_a_network(tmp_path: Path) -> None:
    reason = why_not()
    if reason is not None:
        pytest.skip(reason)
    programs = [str(executable(*name)) for name in (("gsense_rig", "campaign"), ("gsense_fusion", "replay"))]
    programs.append(str(executable("gsense_rig", "dashboard")))
    script = tmp_path / "script"
    script.write_text(SCRIPT.replace("./rig", str(ROOT / "rig")).replace("set -e", f"set -e; cd {tmp_path}"))
    (tmp_path / "plan.yaml").write_text(PLAN)
    done = subprocess.run(
        command(["bash", str(script), *programs]), cwd=ROOT, capture_output=True, text=True, check=False, timeout=500
    )
    assert done.returncode == 0, done.stderr[-2000:]
    assert (tmp_path / "out" / "index.yaml").is_file()
