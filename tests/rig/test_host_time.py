"""The rig's stamps when somebody sets the host's clock in the midst of a run."""

from __future__ import annotations

import pytest

from gsense_rig.loop.clock import HostTime

HOUR_NS = 3600 * 10**9


@pytest.mark.parametrize("step_ns", [HOUR_NS, -HOUR_NS])
def test_stamps_follow_a_step_of_the_clock_once(step_ns: int) -> None:
    host = HostTime(10**18)
    before = host.stamp_ns(100.0)
    assert host.check(10**18 + step_ns)
    assert host.stamp_ns(100.01) - before == step_ns + 10_000_000
    assert not host.check(10**18 + step_ns)


def test_the_noise_of_a_measurement_moves_no_stamp() -> None:
    host = HostTime(10**18)
    assert not host.check(10**18 + 400_000)
    assert host.stamp_ns(1.0) == 10**18 + 10**9
