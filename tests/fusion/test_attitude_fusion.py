"""The live estimator without ROS: how it starts, what it publishes, what it survives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gsense_fusion.attitude import Madgwick, attitude_at_rest
from gsense_fusion.attitude.errors import inclination_error, total_error
from gsense_fusion.attitude.fusion import Channel, Estimate, Fusion
from gsense_fusion.compensation import CompensationFile, GSensitivity, TemperatureBias

STEP = 5_000_000
G = ((0.01, 0.0, 0.002), (0.0, -0.005, 0.001), (0.003, 0.004, 0.02))
BIAS = np.radians([1.0, -2.0, 0.5])
TILT = np.array([0.5, -1.0, 9.7])


def _fusion(file: CompensationFile | None = None) -> Fusion:
    channels = [Channel("madgwick", Madgwick(), False)]
    if file is not None:
        channels.append(Channel("madgwick_gcomp", Madgwick(), True))
    return Fusion(channels, file)


def _feed(fusion: Fusion, first: int, rate: Any, force: Any) -> list[Estimate]:
    out = []
    for i in range(len(rate)):
        out += fusion.add_sample((first + i) * STEP, rate[i], force[i], source=first + i)
    return out


def _rest(n: int, seed: int = 0) -> tuple[Any, Any]:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(n, 3)) * 1e-3 + BIAS, rng.normal(size=(n, 3)) * 0.03 + TILT


def test_every_sample_gets_its_estimate_and_the_first_second_gives_the_start() -> None:
    fusion = _fusion()
    out = _feed(fusion, 1, *_rest(600))
    assert [e.stamp_ns for e in out] == [STEP * i for i in range(1, 601)]
    assert [e.source for e in out] == list(range(1, 601))
    assert fusion.status.rest_seen
    np.testing.assert_allclose(fusion.status.bias[False], BIAS, atol=3e-4)
    up = attitude_at_rest(TILT)[None]
    assert np.degrees(inclination_error(out[-1].quaternion[None], up)[0]) < 0.1


def test_compensated_rate_is_the_input_less_the_terms_and_both_start_alike() -> None:
    file = CompensationFile("s", terms=(GSensitivity(matrix=G), TemperatureBias((1e-3, 0, -1e-3), 20.0)))
    fusion = _fusion(file)
    fusion.add_temperature(30.0)
    rate, force = _rest(600)
    leak = np.array(G) @ TILT + [1e-2, 0, -1e-2]
    out = _feed(fusion, 0, rate + force @ np.array(G).T + [1e-2, 0, -1e-2], force)
    raw = [e for e in out if e.channel == "madgwick"]
    comp = [e for e in out if e.channel == "madgwick_gcomp"]
    assert len(raw) == len(comp) == 600
    np.testing.assert_allclose([e.angular_rate for e in comp], rate, atol=1e-12)
    np.testing.assert_allclose(raw[7].angular_rate, rate[7] + np.array(G) @ force[7] + [1e-2, 0, -1e-2], atol=1e-12)
    np.testing.assert_array_equal(raw[0].quaternion[1:], comp[0].quaternion[1:])
    np.testing.assert_allclose(fusion.status.bias[True], BIAS, atol=3e-4)
    np.testing.assert_allclose(fusion.status.bias[False], BIAS + leak, atol=6e-4)


def test_start_in_motion_is_said_and_corrected_at_rest() -> None:
    file = CompensationFile("s", bias=(0.01, 0.02, 0.03))
    fusion = _fusion(file)
    rate, force = _rest(1000)
    shaken = force[:400] + np.outer(8 * np.sin(np.arange(400) * 0.04), [1, 0, 0])
    _feed(fusion, 0, rate[:400], shaken)
    assert fusion.status.running
    assert not fusion.status.rest_seen
    assert "no rest in the first second" in fusion.status.start
    assert "bias of the compensation file" in fusion.status.start
    np.testing.assert_array_equal(fusion.status.bias[False], [0.01, 0.02, 0.03])
    out = _feed(fusion, 400, rate[400:], force[400:])
    assert fusion.status.rest_seen
    np.testing.assert_allclose(fusion.status.bias[False], BIAS, atol=3e-4)
    assert np.degrees(inclination_error(out[-1].quaternion[None], attitude_at_rest(TILT)[None])[0]) < 0.2


def test_gaps_disorder_and_a_restarted_source() -> None:
    fusion = _fusion()
    rate, force = _rest(500)
    _feed(fusion, 1000, rate[:300], force[:300])
    late = fusion.add_sample(1100 * STEP, rate[0], force[0])
    assert late == []
    assert len(_feed(fusion, 1310, rate[310:320], force[310:320])) == 10
    counts = fusion.status.counts
    assert (counts.gaps, counts.missing, counts.out_of_order, counts.resets) == (1, 10, 1, 0)
    assert _feed(fusion, 0, rate[:200], force[:200]) == []  # the stamps start again: so does the estimator
    assert len(_feed(fusion, 200, rate[200:210], force[200:210])) == 210
    assert fusion.status.counts.resets == 1


def test_field_gives_the_heading_at_the_start() -> None:
    fusion = _fusion()
    rate, _force = _rest(400)
    out = []
    for i in range(400):
        if i % 10 == 0:
            fusion.add_field(np.array([2e-5, 0.0, -4e-5]))
        out += fusion.add_sample(i * STEP, rate[i], np.array([0.0, 0.0, 9.81]), i)
    assert fusion.status.uses_field
    np.testing.assert_allclose(out[-1].quaternion, [np.sqrt(0.5), 0, 0, np.sqrt(0.5)], atol=2e-3)


def test_a_field_that_comes_later_gives_the_heading_at_once() -> None:
    fusion = _fusion()
    rate, force = _rest(420)
    _feed(fusion, 0, rate[:400], force[:400])
    assert not fusion.status.uses_field
    body = np.array([0.0, -2e-5, -4e-5])  # y points south
    fusion.add_field(body)
    out = _feed(fusion, 400, rate[400:], force[400:])
    expected = attitude_at_rest(TILT, body)
    assert total_error(out[-1].quaternion[None], expected[None])[0] < 0.01


def test_without_accelerometer_the_turn_is_counted_from_the_start() -> None:
    fusion = _fusion()
    none = np.full((600, 3), np.nan)
    rate = np.tile(BIAS, (600, 1))
    rate[300:500, 2] += 0.5
    out = _feed(fusion, 0, rate, none)
    assert fusion.status.rest_seen
    assert 2 * np.arcsin(out[-1].quaternion[3]) == pytest.approx(0.5 * 200 * 0.005, abs=1e-9)


def test_a_compensated_channel_needs_a_file() -> None:
    with pytest.raises(ValueError, match="needs a compensation file"):
        Fusion([Channel("x_gcomp", Madgwick(), True)])
