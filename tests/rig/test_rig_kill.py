"""Live over DDS: whichever process of the rig is killed with SIGKILL at 8 rad/s, the motor is stopped and off."""

import os
import signal

import pytest
from tests.rig.processes import alive, children, wait_for

pytest.importorskip("rclpy", reason="needs ROS 2 (./rig test)")
pytest.importorskip("gsense_msgs.msg", reason="needs the built workspace (./rig test)")

from gsense_msgs.msg import RigState
from tests.rig.test_rig_node import Client, start_node

from gsense_rig.hardware.sim_memory import SIZE, RailMemory
from gsense_rig.plant.state import POSITION, SPEED

pytestmark = [pytest.mark.graph, pytest.mark.slow, pytest.mark.usefixtures("domain"), pytest.mark.timeout(600)]


@pytest.fixture
def client():
    client = Client()
    yield client
    client.close()


def rail(file):
    return RailMemory(memoryview(bytearray(file.read_bytes()[:SIZE])))


def loop_of(node):
    """The loop is the node's only child, the guard the loop's."""
    loop = children(node.pid)[0]
    return loop, children(loop)[0]


@pytest.mark.parametrize("victim", ["node", "loop", "guard"])
def test_killed_at_8_rad_s_the_motor_stops(tmp_path, client, victim):
    file = tmp_path / "rail"
    node = start_node(tmp_path, "seed:=3", f"memory:={file}")
    try:
        assert client.call("rig/home").success
        loop, guard = loop_of(node)
        assert client.drive(0.15, 8.0, 1000).accepted
        states = client.got["rig/joint_states"]
        wait_for(lambda: len(states) > 0 and abs(states[-1].velocity[0]) > 1.15)
        os.kill({"node": node.pid, "loop": loop, "guard": guard}[victim], signal.SIGKILL)
        if victim == "guard":
            wait_for(lambda: client.got["rig/state"][-1].fault == RigState.GUARD)
            wait_for(lambda: rail(file).output.disabled)
            assert "guard" in client.got["rig/state"][-1].fault_text
            assert client.got["rig/state"][-1].light == RigState.RED
            assert client.call("rig/reset").success
        else:
            wait_for(lambda: not alive(loop) and not alive(guard))  # both end when the motor is off
        after = rail(file)
        assert after.output.disabled
        assert after.values[SPEED] == 0.0
        assert abs(after.values[POSITION]) < 0.22
        if victim == "loop":
            assert node.wait(60) == 1
            assert "the loop process ended" in node.stderr.read()
    finally:
        node.kill()
        node.wait()
        node.stderr.close()
