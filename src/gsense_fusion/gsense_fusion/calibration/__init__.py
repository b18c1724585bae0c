"""Calibration: gyro (bias, G, k), accelerometer, magnetometer, noise parameters, and exports to other programs."""
