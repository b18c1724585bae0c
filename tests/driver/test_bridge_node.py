"""The node in this process, fed through a pseudo-terminal by an encoder of the tests' own."""

import os
import re
import subprocess
import sys
import threading
import time
from itertools import pairwise

import pytest

rclpy = pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from gsense_msgs.msg import LinkStatus  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.lifecycle import TransitionCallbackReturn  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import BatteryState, Imu, MagneticField, Temperature  # noqa: E402
from tests.driver import wire  # noqa: E402

from gsense_driver.bridge_node import Bridge  # noqa: E402

pytestmark = pytest.mark.usefixtures("domain")

LONG = 90.0  # s that a board plays at most: longer than any wait
IN_BENCH = ("--ros-args", "-r", "__ns:=/bench")
TOPICS = {
    "mpu6050/imu/data_raw": Imu,
    "bno055/imu/data_raw": Imu,
    "lisy300/imu/data_raw": Imu,
    "bno055/imu/data": Imu,
    "bno055/imu/mag": MagneticField,
    "mpu6050/temperature": Temperature,
    "bno055/temperature": Temperature,
    "battery": BatteryState,
    "link": LinkStatus,
    "/diagnostics": DiagnosticArray,
}


class Rig:
    """A bridge on a pseudo-terminal, and what it publishes."""

    def __init__(self, link, context, **parameters):
        self.master = -1
        self.link = link
        self.lock = threading.Lock()
        self.written = self.unwritten = 0
        self.late = 0.0  # s: the writes, at most
        self.stop = False
        self.published = dict.fromkeys(TOPICS, 0)
        self.heard = dict.fromkeys(TOPICS, 0)
        self.arrivals = []
        self.plug()
        given = {"port": str(link), "unit_id": "unit-7", **parameters}
        overrides = [Parameter(name.replace("__", "."), value=value) for name, value in given.items()]
        self.node = Bridge(context=context, parameter_overrides=overrides, namespace="bench")
        self.create_publisher = self.node.create_lifecycle_publisher
        self.node.create_lifecycle_publisher = self.counted_publisher
        self.probe = rclpy.create_node("probe", context=context, namespace="bench")
        self.got = {name: [] for name in TOPICS}
        for name, kind in TOPICS.items():
            self.probe.create_subscription(kind, name, lambda message, name=name: self.hear(name, message), 2000)
        self.executor = SingleThreadedExecutor(context=context)
        self.executor.add_node(self.node)
        self.executor.add_node(self.probe)

    def counted_publisher(self, kind, topic, qos):
        """One of the node's, which counts what it publishes."""
        publisher = self.create_publisher(kind, topic, qos)
        publish = publisher.publish

        def count(message):
            self.published[topic] += publisher.is_activated
            publish(message)

        publisher.publish = count
        return publisher

    def heard_all(self):
        return self.heard == self.published

    def hear(self, name, message):
        if name != "/diagnostics" or message.status[0].name.startswith("bench/"):  # other graphs use this topic too
            self.heard[name] += 1
            self.got[name].append(message)

    def plug(self):
        self.master, slave = os.openpty()
        self.link.unlink(missing_ok=True)
        self.link.symlink_to(os.ttyname(slave))
        self.slave = slave
        self.plugged = True

    def unplug(self):
        with self.lock:
            self.plugged = False
            os.close(self.slave)
            os.close(self.master)
            self.link.unlink()

    def play(self, frames):
        """Write frames at their times, in a thread; returns it and the host time of the board's zero."""
        begin = time.time()

        def write():
            for when, data in frames:
                time.sleep(max(0.0, begin + when - time.time()))
                if self.stop:
                    return
                self.late = max(self.late, time.time() - begin - when)
                with self.lock:
                    if self.plugged:
                        os.write(self.master, wire.cobs(data))
                        self.written += 1
                    else:
                        self.unwritten += 1

        thread = threading.Thread(target=write, daemon=True)
        thread.start()
        return thread, begin

    def spin_until(self, condition, seconds=60.0):
        deadline = time.monotonic() + seconds
        while not condition() and time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.05)
        return condition()


@pytest.fixture
def rig(tmp_path):
    context = rclpy.Context()
    rclpy.init(context=context)
    rig = Rig(tmp_path / "tty", context)
    yield rig
    rig.stop = True
    rig.node.close()
    rig.executor.shutdown()
    rig.node.destroy_node()
    rig.probe.destroy_node()
    rclpy.try_shutdown(context=context)
    if rig.link.is_symlink():
        rig.unplug()


def stamp(message):
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def start(rig):
    """Until the port is open and every topic has found its subscription."""
    rig.node.trigger_configure()
    rig.node.trigger_activate()
    publishers = rig.node._messages.publishers
    assert rig.spin_until(lambda: all(publisher.get_subscription_count() for publisher in publishers))
    assert rig.spin_until(lambda: rig.node._connection.connected)
    feed = rig.node._session.feed

    def note(data, arrival_ns):
        rig.arrivals.append(arrival_ns * 1e-9)
        feed(data, arrival_ns)

    rig.node._session.feed = note


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


def test_parameters_are_checked_and_live_ones_take_effect(rig):
    start(rig)
    (bad,) = rig.node.set_parameters([Parameter("mpu6050.mounting", value="y x z")])
    assert not bad.successful
    assert "mirror" in bad.reason
    (fixed,) = rig.node.set_parameters([Parameter("port", value="/dev/null")])
    assert not fixed.successful
    (good,) = rig.node.set_parameters([Parameter("mpu6050.frame_id", value="chip")])
    assert good.successful
    thread, _ = rig.play(wire.Board().frames(1.0))
    assert rig.spin_until(lambda: not thread.is_alive() and len(rig.got["mpu6050/imu/data_raw"]) >= 190)
    assert rig.got["mpu6050/imu/data_raw"][-1].header.frame_id == "chip"


def written_out(got):
    """Every message by topic with all digits (raw bytes have random padding), without the raw log's own state."""
    for message in got["/diagnostics"]:
        message.status = [status for status in message.status if not status.name.endswith("raw_log")]
    return {topic: [repr(message) for message in messages] for topic, messages in got.items()}


def command_beside(rig, name, *arguments):
    """Run a command of the package beside the node and the probe; its exit code, stdout and stderr."""
    command = [sys.executable, "-m", f"gsense_driver.{name}", *arguments]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment)
    assert rig.spin_until(lambda: process.poll() is not None)
    out, err = process.communicate()
    return process.returncode, out, err


def test_a_replay_of_the_raw_log_gives_the_live_messages_bit_for_bit(rig, tmp_path):
    path = tmp_path / "live.raw"
    (set_path,) = rig.node.set_parameters([Parameter("raw_log", value=str(path))])
    assert set_path.successful
    start(rig)
    for messages in rig.got.values():
        messages.clear()
    frames = wire.Board(slower=4).frames(4.0)
    frames[250] = (frames[250][0], b"\x55" * 32)
    thread, _ = rig.play([frame for i, frame in enumerate(frames) if i not in (100, 200)])
    assert rig.spin_until(lambda: len(rig.got["mpu6050/imu/data_raw"]) > 100)
    rig.node.set_parameters([Parameter("mpu6050.frame_id", value="chip")])
    assert rig.spin_until(lambda: not thread.is_alive())
    assert rig.spin_until(lambda: rig.got["link"] and rig.got["link"][-1].received == len(frames) - 3)
    rig.node.close()
    assert rig.spin_until(rig.heard_all)
    live = written_out(rig.got)
    for messages in rig.got.values():
        messages.clear()
    code, out, err = command_beside(rig, "replay", str(path), "--fast", *IN_BENCH)
    assert (code, err) == (0, "")
    assert "2 lost, 1 corrupt" in out
    assert rig.spin_until(lambda: all(len(rig.got[topic]) >= len(messages) for topic, messages in live.items()))
    rig.spin_until(lambda: False, 1.0)  # more than was live would be wrong as well
    again = written_out(rig.got)
    assert len(live["mpu6050/imu/data_raw"]) > 190
    for topic, messages in live.items():
        extra = len(again[topic]) - len(messages)  # of the seconds before the lists were cleared
        assert extra >= 0
        assert extra == 0 or topic in ("link", "/diagnostics")
        assert again[topic][extra:] == messages, topic


def test_what_cannot_be_replayed_is_said_in_one_line(rig, tmp_path):
    (tmp_path / "other").write_bytes(b"some other file")
    for name, words in (("none", "No such file"), ("other", "is no raw log")):
        code, _, err = command_beside(rig, "replay", str(tmp_path / name))
        assert code == 2
        assert err.startswith("replay: ")
        assert words in err
        assert err.count("\n") == 1


def test_the_monitor_finds_the_bridge_in_its_namespace(rig):
    start(rig)
    thread, _ = rig.play(wire.Board().frames(LONG))
    assert rig.spin_until(lambda: len(rig.got["mpu6050/imu/data_raw"]) > 100)
    code, out, err = command_beside(rig, "monitor", "--once", *IN_BENCH)
    assert (code, err) == (0, "")
    assert "frames/s" in out
    assert "lost 0 corrupt 0" in out
    assert re.search(r"\| (ok|warning|error): .*(samples|frames)", out)  # a busy machine may be a warning
    rig.stop = True
    thread.join()


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


def test_a_raw_log_that_cannot_be_made_fails_the_configuring(rig, tmp_path):
    rig.node.set_parameters([Parameter("raw_log", value=str(tmp_path / "none" / "a.raw"))])
    assert rig.node.trigger_configure() == TransitionCallbackReturn.FAILURE
    rig.node.set_parameters([Parameter("raw_log", value="")])
    assert rig.node.trigger_configure() == TransitionCallbackReturn.SUCCESS


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("transport_delay", 0.2),
        ("transport_delay", float("nan")),
        ("mpu6050.gyro_range_dps", 300),
        ("mpu6050.gyro_noise_density", -1.0),
        ("bno055.gyro_lsb_per_dps", 0.0),
        ("baud", 9600),
        ("raw_log", "/tmp/x"),
        ("port", "/dev/ttyUSB7"),
    ],
)
def test_a_parameter_out_of_range_or_not_live_is_refused_while_configured(rig, name, value):
    before = rig.node.get_parameter(name).value
    assert rig.node.trigger_configure() == TransitionCallbackReturn.SUCCESS
    (result,) = rig.node.set_parameters([Parameter(name, value=value)])
    assert not result.successful
    assert result.reason
    assert rig.node.get_parameter(name).value == before
