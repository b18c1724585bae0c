"""The signals that an effect can add to a gyro or to the carriage's attitude, by their column.

Every gyro channel reads `true rate + terms[chip, axis, :] @ drivers`; the carriage is rotated against the rail by the
rotation vector `tilt[axis, :] @ tilt_drivers`; the rail's field gains `field[axis, :] @ field_drivers`. An effect
therefore only says which coefficients it sets.
"""

from enum import IntEnum


class GyroDriver(IntEnum):
    """Columns of `SignalModel.gyro_terms`; what multiplies the coefficient, in the sensor's axes."""

    ONE = 0
    FORCE_X = 1  # specific force, m/s^2
    FORCE_Y = 2
    FORCE_Z = 3
    WARMTH = 4  # lagged die temperature minus the reference, K
    ACCELERATION_SQUARED = 5  # of the carriage, (m/s^2)^2
    SPEED = 6  # of the carriage along the rail, m/s
    DIRECTION = 7  # -1 to 1: smoothed sign of the speed
    JERK_X = 8  # rate of change of specific force, m/s^3
    JERK_Y = 9
    JERK_Z = 10
    TONE = 11  # sine of fixed frequency while the motor has current
    JUMP = 12  # 0 before, 1 after an instant of the session
    ACCELERATION_CUBED = 13  # along the sensor's own axes, (m/s^2)^3
    SWAY = 14  # acceleration along the sensor's axes through the mount's resonance, m/s^2
    SUPPLY = 15  # the cell's voltage minus that of a full one, V
    RATTLE_X = 16  # vibration of unit strength times the speed, m/s; one for each axis
    RATTLE_Y = 17
    RATTLE_Z = 18


class TiltDriver(IntEnum):
    """Columns of `SignalModel.tilt`."""

    POSITION = 0  # m
    SPEED = 1  # m/s
    ACCELERATION = 2  # m/s^2
    PLAY = 3  # -1 to 1: where the carriage leans in its bearings' play
    TOOTH = 4  # sine of the position over the belt's pitch: rad/s of the rate, its angle is too small to be felt


class FieldDriver(IntEnum):
    """Columns of `SignalModel.field`."""

    POSITION = 0  # m
    CURRENT = 1  # of the motor, A


class Chip(IntEnum):
    """Gyros on the board, the first index of `SignalModel.gyro_terms`."""

    MPU6050 = 0
    BNO055 = 1
    LISY300 = 2
