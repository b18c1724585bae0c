"""The commands beside a live bridge: replay of its raw log, monitor."""

import os
import re
import subprocess
import sys

import pytest

pytest.importorskip("rclpy", reason="rclpy is not installed: run the tests by ./rig test")

from rclpy.parameter import Parameter
from tests.driver import wire
from tests.driver.bridge_rig import LONG, start

pytestmark = pytest.mark.usefixtures("domain")

IN_BENCH = ("--ros-args", "-r", "__ns:=/bench")


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
