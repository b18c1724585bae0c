"""The compensation file and its causal application."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gsense_fusion.compensation import (
    CompensationError,
    CompensationFile,
    Compensator,
    GSensitivity,
    ReferenceTerm,
    TemperatureBias,
    compensate,
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
    reference=(ReferenceTerm("rail_curvature", {"t": (1e-3, 0.0, 2e-3), "u": (0.0, 0.0, 1e-5)}),),
)


@pytest.mark.parametrize(
    "file", [FULL, CompensationFile("bno055"), CompensationFile("mpu6050", terms=(GSensitivity(k=-1.7e-5),))]
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
        (HEAD + "terms: [{effect: magic}]", "terms[0].effect: 'magic' is not known; known: g_sensitivity, temp"),
        (HEAD + "terms: [{effect: g_sensitivity}]", "terms[0].matrix: give either"),
        (HEAD + "terms: [{effect: g_sensitivity, k: 1.0, matrix: []}]", "terms[0].matrix: give either"),
        (HEAD + "terms: [{effect: g_sensitivity, k: 1e-5}]", "write 1.0e-5"),
        (HEAD + "terms: [{effect: g_sensitivity, k: 1.0, K: 2}]", "terms[0].K: not a key"),
        (HEAD + "terms: [{effect: temperature_bias, c: [1, 2, 3], reference: 1, lag_s: -1}]", "terms[0].lag_s"),
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


def test_signs_of_equation_7_4() -> None:
    """omega_x -= k a_y, omega_y -= k a_z, omega_z -= k a_x."""
    file = CompensationFile("s", terms=(GSensitivity(k=0.1),))
    rate = Compensator(file).update(0, np.array([1.0, 2.0, 3.0]), np.array([10.0, 20.0, 30.0]))
    np.testing.assert_allclose(rate, [1.0 - 2.0, 2.0 - 3.0, 3.0 - 1.0])


def _session(n: int = 600) -> tuple[Any, Any, Any, Any]:
    rng = np.random.default_rng(2)
    stamp = np.cumsum(rng.integers(4_000_000, 6_500_000, n)) + 1_760_000_000_000_000_000
    stamp[300:] += 400_000_000  # a gap
    temperature = (stamp[20::25] + 1_000_000, 25 + np.cumsum(rng.normal(size=len(stamp[20::25]))))
    return stamp, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)) * 5 + [0, 0, 9.8], temperature


@pytest.mark.parametrize("delay", [0.0, 0.0004, 0.0123, 0.04, -0.01])
@pytest.mark.parametrize("lag", [0.0, 3.0])
def test_batch_equals_sample_by_sample(delay: float, lag: float) -> None:
    stamp, rate, force, temperature = _session()
    terms = (GSensitivity(matrix=G), TemperatureBias((1e-3, -2e-3, 3e-3), 25.0, lag))
    file = CompensationFile("s", terms=terms, gyro_delay_s=delay)
    live, fed, out = Compensator(file), 0, []
    for i in range(len(stamp)):
        while fed < len(temperature[0]) and temperature[0][fed] <= stamp[i]:
            live.set_temperature(temperature[1][fed])
            fed += 1
        if i == 250:  # a run cut in two goes on identically
            live = Compensator(file, live.state)
        out.append(live.update(int(stamp[i]), rate[i], force[i]))
    batch = compensate(file, stamp, rate, force, temperature)
    np.testing.assert_allclose(batch, out, atol=1e-10, rtol=0)
    assert np.abs(batch - rate).max() > 1e-3


def test_delay_uses_the_specific_force_of_then() -> None:
    stamp = np.arange(100) * 5_000_000
    force = np.zeros((100, 3))
    force[:, 0] = np.arange(100.0)
    file = CompensationFile("s", terms=(GSensitivity(matrix=((1, 0, 0), (0, 0, 0), (0, 0, 0))),), gyro_delay_s=0.02)
    taken = -compensate(file, stamp, np.zeros((100, 3)), force)[:, 0]
    np.testing.assert_allclose(taken[10:], np.arange(6.0, 96.0), atol=1e-9)


def test_temperature_lag_settles_with_its_time_constant() -> None:
    file = CompensationFile("s", terms=(TemperatureBias((1.0, 0.0, 0.0), 20.0, 2.0),))
    live = Compensator(file)
    force = np.array([0, 0, 9.8])
    assert live.update(0, np.zeros(3), force)[0] == 0.0  # no temperature yet: nothing is taken off
    live.set_temperature(20.0)
    live.update(5_000_000, np.zeros(3), force)
    live.set_temperature(30.0)
    for i in range(2, 402):
        rate = live.update(i * 5_000_000, np.zeros(3), force)
    assert rate[0] == pytest.approx(-10 * (1 - np.exp(-1)), abs=0.01)  # after 2 s


def test_without_specific_force_the_g_term_is_left_out() -> None:
    file = CompensationFile("s", bias=(9, 9, 9), terms=(GSensitivity(k=0.1),))
    rate = Compensator(file).update(0, np.ones(3), np.full(3, np.nan))
    np.testing.assert_array_equal(rate, np.ones(3))
    np.testing.assert_array_equal(
        compensate(file, np.array([0]), np.ones((1, 3)), np.full((1, 3), np.nan)), [[1, 1, 1]]
    )
