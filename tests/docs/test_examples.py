"""The example files of the documents do what the documents say of them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests.fusion.rail_run import rail_run

from gsense_fusion.close_loop import main

ROOT = Path(__file__).resolve().parents[2]
SIZE = 2e-3  # (rad/s)/(m/s)^2 on y


@pytest.mark.slow
def test_an_effect_of_ones_own_is_found(tmp_path: Path) -> None:
    bags = [str(rail_run(tmp_path, n, w, lambda v: SIZE * v**2)) for n, w in enumerate((0.0, 3.0, 6.0, 8.0, 5.0))]
    example = ROOT / "docs" / "examples" / "my_effects.py"
    out = tmp_path / "report"
    arguments = ["--fit", *bags[:4], "--held-out", bags[4], "--effects", str(example), "--out", str(out)]
    assert main(arguments) == 0
    report = json.loads((out / "report.json").read_text())
    assert [finding["effect"] for finding in report["findings"]] == ["bearing_rumble"]
    found = report["findings"][0]["parameters"]["c_y"]
    assert found["value"] == pytest.approx(SIZE, abs=4 * found["stderr"])
    assert report["rate_rms"]["full"] < 1.2 * report["rate_rms"]["noise_floor"] < report["rate_rms"]["declared"]
