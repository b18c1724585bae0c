"""The compensation file: what was written is read, and mistakes name file and key."""

from __future__ import annotations

from pathlib import Path

import pytest

from gsense_fusion.compensation import (
    AccelerometerCorrection,
    CompensationError,
    CompensationFile,
    FrictionPickup,
    GCubed,
    GResonance,
    GSensitivity,
    GSquared,
    JerkCoupling,
    MagnetometerCorrection,
    ReferenceTerm,
    ScaleMisalignment,
    SpeedPickup,
    SupplyVoltage,
    TemperatureBias,
    load_compensation,
    write_compensation,
)

G = ((1e-3, 2e-5, -3e-4), (4e-4, -5e-4, 6e-4), (7e-4, 8e-4, 9e-4))
FULL = CompensationFile(
    sensor="mpu6050",
    unit_id="board-3",
    bias=(0.01, -0.02, 0.03),
    terms=(GSensitivity(matrix=G), TemperatureBias((1e-3, -2e-3, 3e-5), 25.0, 4.5)),
    gyro_delay_s=0.0123,
    reference=(
        ReferenceTerm("rail_curvature", {"t": (1e-3, 0.0, 2e-3), "u": (0.0, 0.0, 1e-5)}),
        ReferenceTerm("reversal_rock", {"r": (1e-4, 0.0, 0.0), "width": 2e-4}),
    ),
    accelerometer=AccelerometerCorrection(
        ((1.01, 0.0, 0.0), (0.001, 0.99, 0.0), (0.0, -0.002, 1.0)), (0.1, -0.2, 0.05)
    ),
    magnetometer=MagnetometerCorrection((1e-5, -2e-5, 3e-6), ((1.1, 0.01, 0.0), (0.01, 0.9, 0.0), (0.0, 0.0, 1.0))),
)
EVERY_TERM = CompensationFile(
    sensor="lisy300",
    terms=(
        GSensitivity(k=2e-4),
        GSquared(c=(1e-5, 0.0, 2e-5), direction=(0.0, 0.6, 0.8)),
        GSquared(matrix=G),
        GCubed(matrix=G),
        GCubed(c=(1e-6, 0.0, 2e-5), direction=(1.0, 0.0, 0.0)),
        GCubed(c=(1e-6, 0.0, 2e-5), direction=(1.0, 0.0, 0.0), higher=(-1e-8, 0.0, 0.0)),
        GResonance((1e-4, 0.0, 0.0), (1.0, 0.0, 0.0), 12.0, 0.1),
        GResonance((1e-4, 0.0, 0.0), (1.0, 0.0, 0.0), 12.0, 0.1, rate=(0.0, 1e-6, 0.0)),
        JerkCoupling(c=(1e-5, 0.0, 0.0), direction=(1.0, 0.0, 0.0)),
        JerkCoupling(c=(1e-5, 0.0, 0.0), direction=(1.0, 0.0, 0.0), lag_s=0.004),
        TemperatureBias((1e-3, 0.0, 0.0), 25.0),
        SupplyVoltage((0.01, 0.0, 0.0), 3.7),
        FrictionPickup((1e-4, 0.0, 0.0)),
        FrictionPickup((1e-4, 0.0, 0.0), 1.5),
        SpeedPickup((0.0, 1e-4, 0.0)),
        ScaleMisalignment(((0.01, 0.0, 0.002), (0.0, -0.02, 0.0), (0.0, 0.0, 0.0))),
    ),
)


@pytest.mark.parametrize(
    "file",
    [FULL, EVERY_TERM, CompensationFile("bno055"), CompensationFile("mpu6050", terms=(GSensitivity(k=-1.7e-5),))],
)
def test_what_was_written_is_read(tmp_path: Path, file: CompensationFile) -> None:
    path = tmp_path / "compensation.yaml"
    write_compensation(path, file)
    assert load_compensation(path) == file
    assert [item.name for item in tmp_path.iterdir()] == ["compensation.yaml"]


def test_layout_of_the_documentation_is_read(tmp_path: Path) -> None:
    path = tmp_path / "c.yaml"
    path.write_text("""\
schema: gsense-compensation/1
sensor: mpu6050
unit_id: null
bias: {value: [0.0, 0.0, 0.0], unit: rad/s}
terms:
  - {effect: g_sensitivity, matrix: [[1, 2, 3], [4, 5, 6], [7, 8, 9]], unit: (rad/s)/(m/s^2)}
  - {effect: temperature_bias, c: [1, 0, 0], reference: 25.0, lag_s: 0.0, unit: rad/s/K}
timing: {gyro_delay_s: 0.0}
reference:
  - {effect: rail_curvature, t: [1, 2, 3], u: [0, 0, 0]}
""")
    file = load_compensation(path)
    assert file.terms == (
        GSensitivity(matrix=((1, 2, 3), (4, 5, 6), (7, 8, 9))),
        TemperatureBias((1, 0, 0), 25.0, 0.0),
    )
    assert file.reference[0].parameters["t"] == (1, 2, 3)


HEAD = "schema: gsense-compensation/1\nsensor: mpu6050\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the document: a mapping is needed, not nothing"),
        ("a: [1", "not YAML"),
        ("schema: gsense-compensation/2\nsensor: x", "schema is 'gsense-compensation/2'"),
        ("schema: gsense-compensation/1", "sensor: missing"),
        (HEAD + "bias: {value: [1, 2], unit: rad/s}", "bias.value: three numbers are needed"),
        (HEAD + "bias: {value: [1, 2, 3], unit: deg/s}", "bias.unit: 'deg/s', must be 'rad/s'"),
        (HEAD + "bias: {value: [1, .nan, 3]}", "bias.value: a finite number is needed"),
        (HEAD + "terms: {effect: x}", "terms: a list is needed"),
        (HEAD + "terms: [{effect: magic}]", "terms[0].effect: 'magic' is not known; known: friction_pickup, g_cubed"),
        (HEAD + "terms: [{effect: g_sensitivity}]", "terms[0].matrix: give either"),
        (HEAD + "terms: [{effect: g_sensitivity, k: 1.0, matrix: []}]", "terms[0].matrix: give either"),
        (HEAD + "terms: [{effect: g_sensitivity, k: 1e-5}]", "write 1.0e-5"),
        (HEAD + "terms: [{effect: g_sensitivity, k: 1.0, K: 2}]", "terms[0].K: not a key"),
        (HEAD + "terms: [{effect: temperature_bias, c: [1, 2, 3], reference: 1, lag_s: -1}]", "terms[0].lag_s"),
        (HEAD + "terms: [{effect: g_squared, c: [1, 2, 3]}]", "terms[0].direction: missing"),
        (HEAD + "terms: [{effect: g_cubed, c: [1, 2, 3], direction: [1, 1, 0]}]", "direction: a unit vector"),
        (HEAD + "terms: [{effect: g_squared, matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], higher: [1, 2, 3]}]", "higher"),
        (HEAD + "terms: [{effect: g_resonance, c: [1, 2, 3], direction: [1, 0, 0], f0: 5, damping: 2}]", "damping: 2"),
        (HEAD + "terms: [{effect: jerk_coupling, c: [1, 2, 3], direction: [1, 0, 0], lag_s: 0.2}]", "lag_s: 0.2"),
        (HEAD + "terms: [{effect: scale_misalignment, matrix: [[2, 0, 0], [0, 0, 0], [0, 0, 0]]}]", "more than 50 %"),
        (
            HEAD + "terms: [{effect: supply_voltage, c: [1, 2, 3], reference: 1, unit: V}]",
            "terms[0].unit: 'V', must be",
        ),
        (HEAD + "magnetometer: {hard_iron: [1, 2, 3], soft_iron: [1], unit: T}", "magnetometer.soft_iron: three rows"),
        (HEAD + "reference: [{effect: belt_tilt, c: x}]", "reference[0].c: a finite number"),
        (HEAD + "timing: {gyro_delay: 0.1}", "timing.gyro_delay: not a key"),
        (HEAD + "biass: 3", "biass: not a key"),
    ],
)
def test_mistakes_name_file_and_key(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "c.yaml"
    path.write_text(text)
    with pytest.raises(CompensationError) as caught:
        load_compensation(path)
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_a_missing_file_and_a_value_that_cannot_be_kept(tmp_path: Path) -> None:
    with pytest.raises(CompensationError, match="cannot be read"):
        load_compensation(tmp_path / "none.yaml")
    path = tmp_path / "c.yaml"
    write_compensation(path, FULL)
    with pytest.raises(ValueError, match="cannot hold nan"):
        write_compensation(path, CompensationFile("s", bias=(0.0, float("nan"), 0.0)))
    assert load_compensation(path) == FULL  # the old file is whole
    assert len(list(tmp_path.iterdir())) == 1
