"""A bridge in this process on a pseudo-terminal, fed by an encoder of the tests' own, and what it publishes."""

import os
import threading
import time

import pytest

rclpy = pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from gsense_msgs.msg import LinkStatus  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import BatteryState, Imu, MagneticField, Temperature  # noqa: E402
from tests.driver import wire  # noqa: E402

from gsense_driver.bridge_node import Bridge  # noqa: E402

LONG = 90.0  # s that a board plays at most: longer than any wait
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
