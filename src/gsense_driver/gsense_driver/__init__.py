"""Reads the board's frames from a serial line and publishes them as ROS 2 messages."""
