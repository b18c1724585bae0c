"""Test helper, a process: publishes COUNT numbered Imu messages at RATE, says when all have come, waits to be ended."""

import sys
import time

import rclpy
from rclpy.duration import Duration
from rclpy.qos import QoSProfile
from sensor_msgs.msg import Imu, Temperature


def main() -> None:
    count, rate = int(sys.argv[1]), float(sys.argv[2])
    rclpy.init()
    node = rclpy.create_node("imu_publisher")
    imu = node.create_publisher(Imu, "mpu6050/imu/data_raw", QoSProfile(depth=10000))
    warm = node.create_publisher(Temperature, "mpu6050/temperature", QoSProfile(depth=1000))
    deadline = time.monotonic() + 60.0
    while (imu.get_subscription_count() == 0 or warm.get_subscription_count() == 0) and time.monotonic() < deadline:
        time.sleep(0.05)
    time.sleep(0.3)  # the subscriber's side of the match
    message, temperature = Imu(), Temperature()
    message.header.frame_id = "mpu6050_link"
    start = time.monotonic()
    for k in range(count):
        time.sleep(max(0.0, start + k / rate - time.monotonic()))
        message.header.stamp.sec = k
        message.angular_velocity.x = float(k)
        imu.publish(message)
        if k == 0:
            print("first", flush=True)
        if k % 20 == 0:
            temperature.temperature = float(k)
            warm.publish(temperature)
    for publisher in (imu, warm):
        publisher.wait_for_all_acked(Duration(seconds=20))
    print("published", count, flush=True)
    time.sleep(100.0)


if __name__ == "__main__":
    main()
