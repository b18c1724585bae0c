"""Constants of nature and of the data sheets that the simulated sensors share."""

import math

DEGREE = math.pi / 180.0
STANDARD_GRAVITY = 9.80665
"""m/s^2: the g of the data sheets."""
LOCAL_GRAVITY = 9.81
"""m/s^2: gravity where the simulated rail stands."""
EARTH_RATE = 7.292115e-5
"""rad/s."""
STEP = 1e-3
"""s: the period of the physics, and of the images on the sensor bus."""
REFERENCE_TEMPERATURE = 25.0
"""degC: where a temperature-dependent bias is zero."""
FULL_CELL = 4.2
"""V: where a supply-dependent bias is zero."""
CYCLIC = (1, 2, 0)
"""Thesis, eq. 7.4: the axis of acceleration that the scalar k couples into the x, y and z gyro."""
