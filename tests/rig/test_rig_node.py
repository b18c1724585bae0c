"""The node over DDS: topics at their rates, services, the action, and a clean end."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy", reason="needs ROS 2 (./rig test)")
pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace (./rig test)")

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseStamped  # noqa: E402
from gsense_msgs.action import Move, Sinusoid  # noqa: E402
from gsense_msgs.msg import RigState  # noqa: E402
from rclpy.action import ActionClient  # noqa: E402
from rclpy.context import Context  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from tests.rig.processes import wait_for  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
pytestmark = [pytest.mark.usefixtures("domain"), pytest.mark.timeout(600)]


def stamp(message):
    return message.header.stamp.sec + message.header.stamp.nanosec * 1e-9


def start_node(tmp_path, *parameters):
    arguments = [f for p in (f"bus:={tmp_path / 'bus'}", *parameters) for f in ("-p", p)]
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(ROOT / "src/gsense_rig"), *sys.path]),
    }
    return subprocess.Popen(
        [sys.executable, "-m", "gsense_rig.rig_node", "--ros-args", *arguments],
        env=environment,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )


class Client:
    """Collects what the node publishes, in a thread of its own."""

    TOPICS = (
        ("rig/pose", PoseStamped),
        ("rig/joint_states", JointState),
        ("rig/state", RigState),
        ("/diagnostics", DiagnosticArray),
    )

    def __init__(self):
        self.context = Context()
        rclpy.init(context=self.context)
        self.node = rclpy.create_node("rig_test", context=self.context)
        self.got = {name: [] for name, _ in self.TOPICS}
        for name, kind in self.TOPICS:
            self.node.create_subscription(kind, name, self.got[name].append, 2000)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.thread = threading.Thread(target=self._spin, daemon=True)
        self.thread.start()

    def _spin(self):
        with contextlib.suppress(Exception):  # the context ends under it
            self.executor.spin()

    @staticmethod
    def wait(future, timeout=120.0):
        end = time.monotonic() + timeout
        while not future.done():
            assert time.monotonic() < end, "timed out"
            time.sleep(0.01)
        return future.result()

    def ends_at(self, position):
        """The poses may come later than a result, on a topic of their own."""
        wait_for(lambda: self.got["rig/pose"][-1].pose.position.x == pytest.approx(position, abs=1e-3))

    def up_to_now(self, *names):
        """What each topic told of the same stretch of time, which ends now."""
        now = time.time()
        wait_for(lambda: all(stamp(self.got[name][-1]) >= now for name in names))
        begin = max(stamp(self.got[name][0]) for name in names)
        return [[m for m in list(self.got[name]) if begin <= stamp(m) < now] for name in names]

    def call(self, name):
        client = self.node.create_client(Trigger, name)
        assert client.wait_for_service(120.0)
        return self.wait(client.call_async(Trigger.Request()))

    def drive(self, amplitude, angular_frequency, cycles, feedback=None):
        action = ActionClient(self.node, Sinusoid, "rig/sinusoid")
        assert action.wait_for_server(120.0)
        goal = Sinusoid.Goal(amplitude=amplitude, angular_frequency=angular_frequency, cycles=cycles)
        return self.wait(action.send_goal_async(goal, feedback_callback=feedback))

    def move(self, **goal):
        action = ActionClient(self.node, Move, "rig/move")
        assert action.wait_for_server(120.0)
        return self.wait(action.send_goal_async(Move.Goal(**goal)))

    def close(self):
        self.executor.shutdown(timeout_sec=2.0)
        self.context.try_shutdown()
        self.thread.join(5.0)


@pytest.fixture
def client():
    client = Client()
    yield client
    client.close()


@pytest.mark.graph
def test_home_drive_cancel_and_end(tmp_path, client):
    node = start_node(tmp_path, "seed:=3")
    try:
        home = client.call("rig/home")
        assert home.success, home.message
        assert not client.drive(0.3, 1.0, 1).accepted
        for messages in client.got.values():
            messages.clear()
        feedback = []
        handle = client.drive(0.15, 8.0, 2, feedback.append)
        assert handle.accepted
        outcome = client.wait(handle.get_result_async()).result
        poses, joints, states = client.up_to_now("rig/pose", "rig/joint_states", "rig/state")
        assert outcome.success, outcome.message
        assert 0.0 < outcome.rms_error < 0.5e-3
        assert feedback
        check_motion(poses, joints, states)
        handle = client.drive(0.1, 4.0, 50)
        time.sleep(1.5)
        client.wait(handle.cancel_goal_async())
        outcome = client.wait(handle.get_result_async())
        assert (outcome.status, outcome.result.success, outcome.result.message) == (5, False, "stopped")
        assert client.call("rig/stop").success
        assert not client.call("rig/reset").success
        wait_for(lambda: client.got["rig/state"][-1].mode == RigState.IDLE)
        check_diagnostics(client.got["/diagnostics"])
        node.send_signal(signal.SIGINT)
        assert node.wait(60) == 0
        assert "Traceback" not in node.stderr.read()
    finally:
        node.kill()
        node.wait()
        node.stderr.close()


@pytest.mark.graph
def test_move_park_and_tune(tmp_path, client):
    path = tmp_path / "drive.yaml"
    node = start_node(tmp_path, "seed:=4", f"drive_file:={path}")
    try:
        assert not client.move(shape=Move.Goal.HOLD, position=0.1).accepted  # not homed
        assert "not homed" in client.call("rig/park").message
        assert client.call("rig/home").success
        assert not client.move(shape=Move.Goal.STEP, position=0.3).accepted
        assert not client.move(shape=7).accepted
        for goal, end in (
            ({"shape": Move.Goal.STEP, "position": 0.15, "duration": 0.2}, 0.15),
            ({"shape": Move.Goal.TRIANGLE, "position": 0.05, "amplitude": 0.1, "angular_frequency": 4.0}, -0.05),
            ({"shape": Move.Goal.HOLD, "position": -0.1, "duration": 0.5}, -0.1),
        ):
            handle = client.move(**goal)
            assert handle.accepted
            outcome = client.wait(handle.get_result_async()).result
            assert outcome.success, outcome.message
            assert 0.0 < outcome.rms_error < 2e-3
            client.ends_at(end)
        assert client.call("rig/park").success
        client.ends_at(-0.2)
        tuned = client.call("rig/tune")
        assert tuned.success, tuned.message
        assert "carriage_mass" in tuned.message
        assert "carriage_mass" in path.read_text()
        node.send_signal(signal.SIGINT)
        assert node.wait(60) == 0
    finally:
        node.kill()
        node.wait()
        node.stderr.close()
    path.write_text("schema: gsense-drive/1\ndrive: {carriage_mass: heavy}\n")
    node = start_node(tmp_path, f"drive_file:={path}")
    _, errors = node.communicate(timeout=60)
    assert node.returncode == 2
    assert "`carriage_mass` is not a number" in errors
    assert "Traceback" not in errors


def check_motion(poses, joints, states):
    for messages, period in ((poses, 0.005), (joints, 0.005), (states, 0.02)):
        stamps = np.array([stamp(m) for m in messages])
        assert np.diff(stamps) == pytest.approx(period, abs=1e-5)  # not one lost
    assert len(joints) == len(poses)
    assert len(states) == pytest.approx(len(poses) / 4, abs=1)
    x = np.array([p.pose.position.x for p in poses])
    assert {p.header.frame_id for p in poses} == {"rail"}
    assert x.max() == pytest.approx(0.15, abs=1e-3)
    assert x.min() == pytest.approx(-0.15, abs=1e-3)
    steps = np.diff(x) * 20_000
    assert steps == pytest.approx(np.round(steps), abs=1e-6)  # the raw encoder, not a filtered one
    velocity = np.array([j.velocity[0] for j in joints])
    assert np.abs(velocity).max() == pytest.approx(1.2, abs=0.05)
    assert {tuple(j.name) for j in joints} == {("carriage",)}
    assert {s.mode for s in states} <= {RigState.IDLE, RigState.RUNNING}
    assert RigState.RUNNING in {s.mode for s in states}


def check_diagnostics(messages):
    names = {status.name for message in messages for status in message.status}
    assert names == {"rig: rig", "rig: loop"}
    values = {v.key: v.value for status in messages[-1].status for v in status.values}
    assert int(values["ticks"]) > 0


@pytest.mark.parametrize(
    ("parameter", "words"),
    [
        ("hardware:=mf624", "no MF624 card"),
        ("hardware:=labjack", "hardware 'labjack' is unknown"),
        ("controller:=pid", "controller 'pid' is unknown"),
        ("effects:=['no_such_effect=1']", "no_such_effect"),
    ],
)
@pytest.mark.graph
def test_what_cannot_start_says_so_in_one_line_and_exits_2(tmp_path, parameter, words):
    if "mf624" in parameter and any(Path("/sys/class/uio").glob("uio*")):
        pytest.skip("this machine has UIO devices")
    node = start_node(tmp_path, parameter)
    _, errors = node.communicate(timeout=60)
    assert node.returncode == 2
    lines = [line for line in errors.splitlines() if line.startswith("rig: ")]
    assert len(lines) == 1
    assert words in lines[0]
    assert "Traceback" not in errors
    assert not list(tmp_path.iterdir())
