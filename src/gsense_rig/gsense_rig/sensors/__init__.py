"""Physics of the simulated board's sensors, and the sensor bus that carries them to the firmware."""
