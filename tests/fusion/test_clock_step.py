"""A bag in whose midst the host's clock was set by an hour: refused by name, not taken for an hour of losses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.fusion.bag_data import START_NS, BagWriter, imu

from gsense_fusion.close_loop import main

HOUR_NS = 3600 * 10**9


@pytest.mark.parametrize("step_ns", [HOUR_NS, -HOUR_NS])
def test_a_step_within_a_run_is_said_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], step_ns: int
) -> None:
    draw = np.random.default_rng(1)
    bag = BagWriter()
    for i in range(2000):
        at = START_NS + 10_000_000 * i + (step_ns if i >= 1000 else 0)
        bag.add("/mpu6050/imu/data_raw", at, imu(at, 1e-3 * draw.standard_normal(3), (0.0, 0.0, 9.81)))
    bag.write(tmp_path / "run")
    assert main(["--fit", str(tmp_path / "run"), "--out", str(tmp_path / "out")]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert "has 2000 samples where its stamps make room for" in lines[0]
    assert not (tmp_path / "out").exists()
