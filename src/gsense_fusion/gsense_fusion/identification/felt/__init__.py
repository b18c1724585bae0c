"""What the accelerometer feels of a carriage that turns."""
