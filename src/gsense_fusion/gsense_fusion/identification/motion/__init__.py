"""How the carriage moved and how the board sits on it: encoder, accelerometer, mounting, delays, the earth's turn."""
