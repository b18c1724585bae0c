"""No filter gets worse on the bags of this folder, nor on measured ones: bounds for each metric and segment.

The bounds are errors as measured when they were stored, with some slack (make.py); compensation off and on.
"""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import yaml

from gsense_fusion.bags import load_run
from gsense_fusion.compensation import load_compensation

from .segments import errors

HERE = Path(__file__).resolve().parent
BOUNDS = HERE / "bounds.yaml"
COMPENSATION = "compensation.yaml"
SIMULATED = (("rail_7.mcap", "mpu6050", COMPENSATION), ("rail_7.mcap", "bno055", COMPENSATION))
RECORDED = (
    ("07_undisturbed_fast_rotation_B", "broad", ""),
    ("10_undisturbed_slow_translation_A", "broad", ""),
    ("15_undisturbed_fast_translation_A", "broad", ""),
    ("24_disturbed_tapping_A", "broad", ""),
)


def home() -> Path:
    """Folder of the measured recordings."""
    return Path(os.environ.get("GSENSE_DATA", HERE.parents[2] / "shared" / "data"))


def check(path: Path, bag: str, sensor: str, compensation: str) -> None:
    file = load_compensation(HERE / compensation) if compensation else None
    found = errors(load_run(path, sensor), file)
    bounds = yaml.safe_load(BOUNDS.read_text())[f"{bag} {sensor}"]
    assert set(found) == set(bounds), "a filter came or went: run tests/bags/make.py"
    worse = [
        f"{channel} {part} {metric}: {value:.4f} deg, bound {bounds[channel][part][metric]}"
        for channel, parts in found.items()
        for part, values in parts.items()
        for metric, value in values.items()
        if not value <= bounds[channel][part][metric]
    ]
    assert not worse, "\n".join(worse)


@pytest.mark.parametrize(("bag", "sensor", "compensation"), SIMULATED)
def test_simulated(bag: str, sensor: str, compensation: str) -> None:
    check(HERE / bag, bag, sensor, compensation)


@pytest.mark.data
@pytest.mark.slow
@pytest.mark.parametrize(("bag", "sensor", "compensation"), RECORDED)
def test_measured(bag: str, sensor: str, compensation: str) -> None:
    path = home() / "broad" / bag
    if not path.exists():
        pytest.skip(f"recording {bag} is not here ({home()}; set GSENSE_DATA to the folder of recordings)")
    check(path, bag, sensor, compensation)
