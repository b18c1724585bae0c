"""The bridge's messages, its port and its life cycle."""

from itertools import pairwise

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")

from rclpy.lifecycle import TransitionCallbackReturn
from rclpy.parameter import Parameter
from tests.driver import wire
from tests.driver.bridge_rig import LONG, start

pytestmark = pytest.mark.usefixtures("domain")


def stamp(message):
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def test_topics_values_stamps_and_link(rig):
    """At a quarter of a board's rate, so that a slow machine keeps up: board, driver and listener are one process."""
    start(rig)
    body = wire.mpu_body(acc=(0, 0, 8192), gyr=(655, 0, 0), temperature=-521, lisy=8192)
    frames = wire.Board(mpu=lambda _t: body, slower=4).frames(3.0)
    frames.append((3.0, wire.payload(4, len(frames), 3_000_000, wire.ndof_body())))
    dropped = [frame for i, frame in enumerate(frames) if i not in (100, 200, 201)]
    thread, begin = rig.play(dropped)
    assert rig.spin_until(lambda: not thread.is_alive() and len(rig.got["bno055/imu/data"]) == 1)
    counts = rig.node._session.pipeline.link
    assert rig.spin_until(lambda: rig.got["link"] and rig.got["link"][-1].received == len(dropped)), counts.counts
    assert rig.spin_until(rig.heard_all), (rig.heard, rig.published)
    got = rig.got
    mpu, lisy, bno = (got[f"{name}/imu/data_raw"] for name in ("mpu6050", "lisy300", "bno055"))
    sent = [data[0] & 31 for _, data in dropped]
    assert (len(mpu), len(lisy), len(bno)) == (sent.count(1), sent.count(1), sent.count(2))
    assert mpu[0].linear_acceleration.z == pytest.approx(9.80665)
    assert mpu[0].angular_velocity.x == pytest.approx(0.17453, abs=1e-4)
    assert mpu[0].orientation_covariance[0] == -1.0
    assert mpu[0].angular_velocity_covariance[0] > 0
    assert lisy[0].linear_acceleration_covariance[0] == -1.0
    assert list(lisy[0].angular_velocity_covariance)[0:9:4][:2] == [1e6, 1e6]
    assert [stamp(m) for m in mpu] == [stamp(m) for m in lisy]
    # All come in order, the first ones too, which waited for the clock; at the board's times plus a constant, as
    # exactly as the machine let this process write and read.
    pause = rig.late + max(b - a for a, b in pairwise(rig.arrivals)) - 0.02
    errors = [
        stamp(m) - begin - when for m, (when, _) in zip(mpu, [f for f in dropped if f[1][0] & 31 == 1], strict=True)
    ]
    assert max(errors) - min(errors) < max(5e-3, pause)
    assert got["bno055/imu/data"][0].linear_acceleration.z == pytest.approx(9.80665)
    assert got["bno055/imu/data"][0].angular_velocity_covariance[0] == -1.0
    assert len(got["bno055/imu/mag"]) == 1
    assert got["bno055/imu/mag"][0].magnetic_field.x == pytest.approx(20e-6)
    assert 25 <= len(got["mpu6050/temperature"]) <= 31
    assert got["mpu6050/temperature"][0].temperature == pytest.approx(35.0, abs=0.01)
    assert got["battery"][0].voltage == pytest.approx(3.9)
    link = got["link"][-1]
    assert (link.lost, link.corrupt, link.duplicate, link.reordered, link.restarts) == (3, 0, 0, 0, 0)
    assert link.unit_id == "unit-7"
    names = {status.name for status in got["/diagnostics"][-1].status}
    assert names == {f"bench/bridge: {task}" for task in ("link", "clock", "mpu6050", "bno055", "lisy300")}


def test_a_port_that_vanishes_and_comes_back_elsewhere(rig):
    start(rig)
    thread, _ = rig.play(wire.Board().frames(LONG))
    mpu = rig.got["mpu6050/imu/data_raw"]
    assert rig.spin_until(lambda: len(mpu) >= 150)
    rig.unplug()
    assert rig.spin_until(lambda: not rig.node._connection.connected)
    rig.got["/diagnostics"].clear()
    assert rig.spin_until(lambda: len(rig.got["/diagnostics"]) >= 1)
    link = next(status for status in rig.got["/diagnostics"][-1].status if status.name.endswith("link"))
    assert link.level == b"\x02"
    assert "port" in link.message
    rig.plug()
    assert rig.spin_until(lambda: rig.node._connection.connected)
    count = len(mpu)
    assert rig.spin_until(lambda: len(mpu) >= count + 150)
    rig.stop = True
    assert rig.spin_until(lambda: not thread.is_alive())
    link = rig.node._session.pipeline.link
    assert rig.spin_until(lambda: link.counts.received + link.counts.lost == rig.written + rig.unwritten)
    assert link.counts.lost >= rig.unwritten > 0
    assert (link.counts.restarts, link.counts.corrupt) == (0, 0)
    assert rig.spin_until(lambda: len(mpu) > 0.9 * (link.counts.received * 2 / 3))


def test_deactivated_cleaned_up_and_configured_anew(rig, tmp_path):
    node, got = rig.node, rig.got["mpu6050/imu/data_raw"]
    start(rig)
    thread, _ = rig.play(wire.Board().frames(LONG))
    assert rig.spin_until(lambda: len(got) > 50)
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    assert not node._connection.connected
    published, written, count = dict(rig.published), rig.written, rig.published["mpu6050/imu/data_raw"]
    assert rig.spin_until(lambda: rig.heard_all() and rig.written > written + 150)  # the board goes on sending
    assert rig.published == published
    assert len(got) == count
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    assert rig.spin_until(lambda: len(got) > count + 50)
    assert node.trigger_deactivate() == TransitionCallbackReturn.SUCCESS
    assert node.trigger_cleanup() == TransitionCallbackReturn.SUCCESS
    # Unconfigured, every parameter may change, but only to what makes sense.
    bad = [Parameter("port", value=" "), Parameter("baud", value=5), Parameter("protocol", value="morse")]
    bad += [Parameter("text.columns", value=["who"]), Parameter("autostart", value=False)]
    assert [result.successful for result in node.set_parameters(bad)] == [False] * len(bad)
    other = tmp_path / "other"
    other.symlink_to(rig.link.resolve())
    new = [Parameter("port", value=str(other)), Parameter("unit_id", value="unit-8")]
    assert all(result.successful for result in node.set_parameters(new))
    assert node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    assert node.trigger_activate() == TransitionCallbackReturn.SUCCESS
    count = len(got)
    assert rig.spin_until(lambda: len(got) > count + 50)
    assert rig.spin_until(lambda: [m.unit_id for m in rig.got["link"][-1:]] == ["unit-8"])
    rig.stop = True
    thread.join()
    assert node.trigger_shutdown() == TransitionCallbackReturn.SUCCESS
    assert not node._connection.connected
