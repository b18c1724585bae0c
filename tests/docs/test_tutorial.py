"""The tutorial on the simulated rig, typed command by command in a folder of its own, on shorter runs."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest
import yaml
from tests.docs.documents import ROOT, blocks

from gsense_rig.campaign.plan import parse_plan

PAGE = ROOT / "docs" / "tutorial-simulated.md"
SHORTER = {
    # the live campaign waits for real time: tests/graph/test_campaign.py runs it
    "campaign plan.yaml --out live --yes": "simulate plan.yaml --out live",
    "simulate demo": "simulate quick.yaml",
}
SECONDS = 8


@pytest.fixture(scope="module")
def typed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """Every command's output, and the folder where they ran; a file that the page shows is written first."""
    folder = tmp_path_factory.mktemp("tutorial")
    for name in ("rig", "docs"):
        (folder / name).symlink_to(ROOT / name)
    plan = yaml.safe_load((ROOT / "src/gsense_rig/gsense_rig/campaign/plans/demo.yaml").read_text(encoding="utf-8"))
    for run in plan["runs"]:
        run["duration"] = SECONDS if run["shape"] == "sine" else 2 * SECONDS
    (folder / "quick.yaml").write_text(yaml.safe_dump(plan))
    outputs = {}
    for block in blocks(PAGE):
        if block.language == "yaml":
            (folder / "plan.yaml").write_text(block.text)
        elif not block.language:
            command = block.text
            for long, short in SHORTER.items():
                command = command.replace(long, short)
            environment = os.environ | {"OMP_NUM_THREADS": "1"}
            done = subprocess.run(
                ["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, f"{command}\n{done.stderr}"
            outputs[block.text] = done.stdout
    return folder, outputs


@pytest.mark.slow
def test_the_hidden_effect_is_named(typed: tuple[Path, dict[str, str]]) -> None:
    folder, outputs = typed
    assert len(outputs) >= 7
    report = json.loads((folder / "report" / "report.json").read_text())
    assert "rail_curvature" in [finding["effect"] for finding in report["findings"]]
    assert report["rate_rms"]["full"] < 1.2 * report["rate_rms"]["noise_floor"]
    assert (folder / "report" / "report.html").exists()


@pytest.mark.slow
def test_the_other_files_are_there(typed: tuple[Path, dict[str, str]]) -> None:
    folder, outputs = typed
    assert (folder / "run.png").exists()
    accuracy = json.loads((folder / "replayed" / "accuracy.json").read_text())
    assert set(accuracy["filters"]) == {"madgwick", "rig_aided"}
    (comparison,) = [text for command, text in outputs.items() if "--compare" in command]
    assert "nothing changed" in comparison


def test_the_plan_is_one() -> None:
    (block,) = [block for block in blocks(PAGE) if block.language == "yaml"]
    assert len(parse_plan(block.text, "plan.yaml").runs) == 2
