"""What the bounded-motion filter remembers between samples: one array."""

from __future__ import annotations

from enum import IntEnum


class Cell(IntEnum):
    """Where the memory holds what."""

    OUTPUT = 0  # attitude with heading
    KALMAN = 4  # attitude in the filter's earth frame
    BIAS = 8
    VELOCITY = 11
    COVARIANCE = 14  # 8 x 8
    FORCE_SUM = 78  # integral of the specific force in the earth frame since the last correction, m/s
    TURN_SUM = 81  # integral of the matrix body -> earth, 3 x 3, s
    TIME = 90  # s
    RATE_SQUARED = 91  # integral, rad^2/s
    FORCE_SQUARED = 92  # integral of the squared acceleration
    RATE_LOW = 93
    FORCE_LOW = 96
    STARTED = 99
    STILL_FOR = 100
    GRAVITY = 101
    DELTA = 102  # heading of the filter's earth frame, rad
    FIELD_AGE = 103
    FIELDS = 104  # how many, at first
    FIELD_NORM = 105
    FIELD_DIP = 106
    OFF_FOR = 107
    OFF_NORM = 108
    OFF_DIP = 109
    GAINS = 110
    Q_RATE = 110
    Q_RATE_SCALE = 111
    Q_FORCE = 112
    Q_FORCE_SCALE = 113
    Q_BIAS = 114
    R_VELOCITY = 115
    R_REST = 116
    REST_RATE = 117
    REST_FORCE = 118
    REST_S = 119
    STEP_S = 120
    HEADING_TAU = 121
    FIELD_STRENGTH = 122
    FIELD_DIP_LIMIT = 123
    FIELD_NEW_S = 124
    END = 125
