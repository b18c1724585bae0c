"""One sinusoid through the whole graph: what was asked for, what encoder and accelerometer saw."""

from __future__ import annotations

import numpy as np
import pytest

from .conftest import AMPLITUDE, ANGULAR_FREQUENCY

pytestmark = [pytest.mark.graph, pytest.mark.timeout(600)]


def test_result_and_feedback(told):
    assert told.motion.success, told.motion.message
    assert 0.0 < told.motion.rms_error < 1e-3
    assert len(told.feedback) > 10
    assert max(abs(f.position) for f in told.feedback) <= AMPLITUDE + 1e-3


def test_encoder_pose(told):
    poses = told.ears.messages("/rig/pose")
    assert {p.header.frame_id for p in poses} == {"rail"}
    x = _moving(told, poses, lambda p: p.pose.position.x)
    assert x.max() == pytest.approx(AMPLITUDE, abs=2e-3)
    assert x.min() == pytest.approx(-AMPLITUDE, abs=2e-3)


def test_joint_states(told):
    joints = told.ears.messages("/rig/joint_states")
    assert {tuple(j.name) for j in joints} == {("carriage",)}
    assert all(len(j.position) == len(j.velocity) == 1 for j in joints)
    speed = _moving(told, joints, lambda j: j.velocity[0])
    assert np.abs(speed).max() == pytest.approx(AMPLITUDE * ANGULAR_FREQUENCY, rel=0.1)


def test_state_runs_and_comes_to_rest(told):
    states = told.ears.messages("/rig/state")
    kind = type(states[0])
    modes = [s.mode for s in states]
    assert kind.RUNNING in modes
    assert kind.HOMING in modes
    assert modes[-1] == kind.IDLE
    assert {s.fault for s in states} == {kind.NONE}


def test_accelerometer_sees_the_acceleration_of_the_encoder(told):
    """The board's clock and the rig's are one time: the two agree in size and to a few milliseconds."""
    imu = told.ears.messages("/mpu6050/imu/data_raw")
    poses = told.ears.messages("/rig/pose")
    t_force, force = _series(told, imu, lambda m: m.linear_acceleration.x)
    t_pose, x = _series(told, poses, lambda p: p.pose.position.x)
    start, stop = _steady(t_pose, x)
    size, phase = _tone(t_force, force, start, stop)
    size_x, phase_x = _tone(t_pose, x, start, stop)
    assert size == pytest.approx(size_x * ANGULAR_FREQUENCY**2, rel=0.05)
    delay = np.angle(np.exp(1j * (phase_x + np.pi - phase))) / ANGULAR_FREQUENCY
    assert abs(delay) < 0.012  # the chip's filter delays by some 5 ms


def _time(message, epoch: int) -> float:
    stamp = message.header.stamp
    return (stamp.sec * 1_000_000_000 + stamp.nanosec - epoch) * 1e-9


def _series(told, messages, value):
    time = np.array([_time(m, told.window[0]) for m in messages])
    inside = (time >= 0) & (time < (told.window[1] - told.window[0]) * 1e-9)
    return time[inside], np.array([value(m) for m in messages])[inside]


def _moving(told, messages, value):
    return _series(told, messages, value)[1]


def _steady(time, x):
    """Two whole cycles in the middle of the motion."""
    moving = time[np.abs(x) > 0.05]
    middle = (moving[0] + moving[-1]) / 2
    half = 2 * np.pi / ANGULAR_FREQUENCY
    return middle - half, middle + half


def _tone(time, values, start, stop):
    """Amplitude and phase at the drive's frequency."""
    inside = (time >= start) & (time < stop)
    t = time[inside]
    columns = np.column_stack([np.ones(len(t)), np.cos(ANGULAR_FREQUENCY * t), np.sin(ANGULAR_FREQUENCY * t)])
    _, c, s = np.linalg.lstsq(columns, values[inside], rcond=None)[0]
    return np.hypot(c, s), np.arctan2(-s, c)
