"""Modes, faults, their detection, homing and stopping. Pure: no ROS, no clock, no hardware."""
