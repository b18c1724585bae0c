"""Test helper, a process: an inertial unit strapped on the carriage, by somebody who has never heard of gsense.

Publishes /vectornav/imu (device under test: g-sensitivity K, a bias) and /ahrs/imu (an AHRS: its orientation is level),
best effort as sensor drivers do, 100 Hz. The carriage's motion comes from /rig/joint_states.
"""

import collections
import sys

import numpy as np
import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu, JointState, Temperature

K, BIAS, GRAVITY = float(sys.argv[1]), (0.004, -0.003, 0.002), 9.81
NOISE_RATE, NOISE_FORCE = 5e-4, 0.02
HALF = 4  # samples of 5 ms on either side for the acceleration
SLOPE = np.arange(-HALF, HALF + 1) / (0.005 * np.sum(np.arange(-HALF, HALF + 1) ** 2))
BEST_EFFORT = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("vn100")
    sensor = node.create_publisher(Imu, "/vectornav/imu", BEST_EFFORT)
    ahrs = node.create_publisher(Imu, "/ahrs/imu", BEST_EFFORT)
    warm = node.create_publisher(Temperature, "/vectornav/temperature", BEST_EFFORT)
    rng = np.random.default_rng(5)
    window = collections.deque(maxlen=2 * HALF + 1)

    def on_joint(joint: JointState) -> None:
        window.append((joint.header.stamp, joint.velocity[0]))
        on_joint.count += 1
        if len(window) < window.maxlen or on_joint.count % 2:
            return
        slope = float(SLOPE @ [v for _, v in window])
        force = np.array([slope, 0.0, GRAVITY])
        message = Imu()
        message.header.stamp, message.header.frame_id = window[HALF][0], "vectornav"
        # a rate about each axis by the force along the next one
        rate = np.array(BIAS) + K * np.roll(force, -1) + NOISE_RATE * rng.normal(size=3)
        force = force + NOISE_FORCE * rng.normal(size=3)
        v, f = message.angular_velocity, message.linear_acceleration
        v.x, v.y, v.z = map(float, rate)
        f.x, f.y, f.z = map(float, force)
        message.orientation_covariance[0] = -1.0
        sensor.publish(message)
        level = Imu(header=message.header)
        level.orientation.w = 1.0
        level.angular_velocity_covariance[0] = level.linear_acceleration_covariance[0] = -1.0
        ahrs.publish(level)
        if on_joint.count % 100 == 0:
            warm.publish(Temperature(header=message.header, temperature=25.0))

    on_joint.count = 0
    node.create_subscription(JointState, "/rig/joint_states", on_joint, 4000)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
